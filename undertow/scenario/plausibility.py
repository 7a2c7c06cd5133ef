"""Advice on what a scenario can run but surely does not mean; each names the numbers that caused it, and the line.

Here is what concerns angles, ends and depths; what takes more than the thrusters have is in `motion_plausibility.py`.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractReference, FreeSurface
from undertow.core.errors import Advice, advice
from undertow.core.kept_programs import briefly_compiled
from undertow.physics.disturbances.surface import stated_depths
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.motion_plausibility import motion_advice, path_begins_elsewhere
from undertow.scenario.reference_samples import SAMPLES, ReferenceSamples, desired_motion, samples_at
from undertow.simulation.loop.closed_loop import ClosedLoop

_LONG = 1e6  # s, by when a reference that ends has ended
_FULL_TURN = 2 * np.pi
_RISES = 0.2  # m above the start; less is no mistake of sign
_HIGHER = 0.02  # of the hull above where it floats; less is a ripple
_SURFACE = "The surface is `depth` of the disturbance above the world's origin, and down is positive downward"


@np.errstate(over="ignore", invalid="ignore")  # numbers near the largest double may be among those that are not meant
def plausibility(loop: ClosedLoop, duration: float, start: list[float] | None) -> tuple[Advice, ...]:
    """Advice for each thing that is surely not meant.

    Args:
        loop: of the scenario.
        duration: of the run, s.
        start: initial position, one entry per output, m and rad; None for zero.
    """
    desired = desired_motion(loop, duration, start)
    all_advice = [*_angles(loop, desired), *_unfinished(loop.reference, desired)]
    if isinstance(loop.plant, HybridVehicle):
        all_advice += [*_above(loop, desired), *motion_advice(loop, loop.plant, desired)]
    return tuple(all_advice)


def start_and_angles(loop: ClosedLoop, duration: float, start: list[float] | None) -> tuple[Advice, ...]:
    """Of `plausibility`, for the same arguments, what is said of angles and of a path that begins elsewhere."""
    desired = desired_motion(loop, duration, start)
    elsewhere = path_begins_elsewhere(desired) if isinstance(loop.plant, HybridVehicle) else ()
    return (*_angles(loop, desired), *elsewhere)


def _angles(loop: ClosedLoop, desired: ReferenceSamples):
    """Degrees where radians are due: whole numbers beyond a turn. A pitch beyond 90 degrees."""
    plant = loop.plant
    positions_of_key = {"reference": [desired.position[-1], desired.position[0]], "initial.position": [desired.start]}
    for name, positions in positions_of_key.items():
        for axis in np.flatnonzero(loop.controller.model.coordinates.angles):
            values = [float(row[axis]) for row in positions]
            in_degrees = [value for value in values if abs(value) > _FULL_TURN and value % 1 == 0]
            if in_degrees:
                output, value = plant.outputs[axis], in_degrees[0]
                message = f"`{name}` has {output} at {value:g} rad, which is {abs(value) / _FULL_TURN:.3g} turns"
                yield advice(name, message, f"Angles are in radians: {value:g} degrees are {np.radians(value):.4g} rad")
    if isinstance(plant, HybridVehicle):
        steepest = float(np.abs(desired.position[:, 4]).max())
        if np.pi / 2 < steepest < _FULL_TURN:
            message = f"`reference` has a pitch of up to {steepest:.4g} rad ({np.degrees(steepest):.4g} degrees)"
            yield advice(
                "reference", f"{message}, beyond 90 degrees, where roll and yaw turn over", "Angles are in radians"
            )


def _unfinished(reference: AbstractReference, desired: ReferenceSamples):
    """A reference that comes to rest after the end of the run."""
    duration = float(desired.time[-1])
    late_samples = samples_at(reference, np.geomspace(duration, max(_LONG, 2 * duration), SAMPLES), desired.start)
    if not np.isfinite(late_samples.position).all():
        return
    goal = late_samples.position[-1]
    size = 1e-9 * np.ptp(late_samples.position, axis=0).max()
    arrived = np.abs(late_samples.position - goal).max(axis=1) <= size
    if arrived.all() or not arrived[-2:].all() or late_samples.velocity[-2:].any() or size == 0:
        return
    last = int(np.flatnonzero(~arrived)[-1])
    times = np.linspace(late_samples.time[last], late_samples.time[last + 1], SAMPLES)
    samples_between = samples_at(reference, times, desired.start)
    ends = samples_between.time[np.abs(samples_between.position - goal).max(axis=1) <= size][0]
    message = f"the run ends at {duration:g} s, before the reference reaches its end at {ends:.3g} s"
    yield advice("loop.duration", message, f"Give `loop.duration` at least {ends:.3g} s, unless a part is enough")


def _above(loop: ClosedLoop, desired: ReferenceSamples):
    """Positions above the surface, or above the start where a depth was meant."""
    down = desired.position[:, 2]
    start = float(desired.start[2])
    highest = float(down.min())
    depths = stated_depths(loop.disturbance)
    if depths:
        surface = -depths[0]
        for name, value in (("reference", highest), ("initial.position", start)):
            if value < surface:
                message = f"`{name}` is at down = {value:.4g} m, above the surface at down = {surface:.4g} m"
                yield advice(name, message, _SURFACE)
        if start >= surface:
            yield from _out_of_water(loop, desired.start, depths[0])
        if len(set(depths)) > 1:
            message = f"`disturbance` states the depth of the world's origin as {depths[0]:g} m and as {depths[-1]:g} m"
            yield advice(
                "disturbance", message, "Give all of them the same `depth`: the first one is where the surface is"
            )
        return
    if highest < -_RISES and down.max() <= 0 <= start:
        message = f"`reference` leads to down = {highest:.4g} m, {start - highest:.4g} m above the start at down = "
        hint = f"Down is positive downward: a depth of {-highest:.4g} m is {-highest:.4g}"
        yield advice("reference", f"{message}{start:.4g} m", hint)


def _out_of_water(loop: ClosedLoop, start: Float[np.ndarray, " 6"], depth: float):
    """A vehicle that starts higher in the water than it floats."""
    plant = loop.plant
    assert isinstance(plant, HybridVehicle)
    submerged = 1 - float(_dry_share(plant, as_array(start), as_array(depth)))
    floats = min(1.0, float(plant.body.weight) / float(plant.body.buoyancy))
    if submerged < floats - _HIGHER:
        message = (
            f"`initial.position` puts the vehicle into the water with {100 * submerged:.0f} % of its hull, but it "
            f"floats with {100 * floats:.0f} %: it falls into the water"
        )
        yield advice("initial.position", message, _SURFACE)


@briefly_compiled
def _dry_share(plant: HybridVehicle, start, depth):
    """Share of the hull above still water, at the start; `depth` is that of the world's origin, m."""
    x = plant.initial_state(start)
    surface = FreeSurface(depth, jnp.zeros(()))
    return plant.hull.cut(surface, x.position, plant.pose(x).rotation[2], plant.body).dry
