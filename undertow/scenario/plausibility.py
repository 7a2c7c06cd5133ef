"""Advice on what a scenario can run but surely does not mean; each names the numbers that caused it, and the line.

Only what holds whatever the controller does is said: speeds are compared with one that no direction exceeds, and a
current with the one that the thrusters can balance.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.analysis.thrust_reserve import reference_reserve
from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractReference, FreeSurface
from undertow.core.errors import Advice, advice
from undertow.core.kept_programs import briefly_compiled
from undertow.physics.disturbances.current import Current
from undertow.physics.disturbances.gauss_markov_current import GaussMarkovCurrent
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.disturbances.surface import stated_depths
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.unactuated_attitude import acting_directions, body_force, largest_lean, rotations
from undertow.simulation.loop.closed_loop import ClosedLoop

_SAMPLES = 201  # instants at which a reference is looked at
_LONG = 1e6  # s, by when a reference that ends has ended
_FULL_TURN = 2 * np.pi
_RISES = 0.2  # m above the start; less is no mistake of sign
_SPARE = 1.05  # a speed is too large from this multiple of the top speed on
_HIGHER = 0.02  # of the hull above where it floats; less is a ripple
_SURFACE = "The surface is `depth` of the disturbance above the world's origin, and down is positive downward"
_JUMP = 1.0  # m from the vehicle; a path that begins farther away begins with an error of this size
_FAR = 10.0  # s at top speed; a longer step saturates the thrusters for long
_DIRECTIONS = 2000
_EASY, _LOOKS = 0.4, 41  # a motion through the water that is slower than this share of the top speed; instants
_AT_REST = 1e-3  # m/s
_SHARES = 101  # of a current, tried one after the other
_LEANS = 1.0  # rad; less is the way of such a vehicle
_BALANCED = 0.01  # of the force: what may be left of it


class ReferenceSamples(NamedTuple):
    """A reference at instants, and where the plant starts."""

    time: Float[np.ndarray, " k"]  # s
    position: Float[np.ndarray, "k n"]  # m, rad
    velocity: Float[np.ndarray, "k n"]  # m/s, rad/s
    start: Float[np.ndarray, " n"]  # position of the plant at t = 0


@np.errstate(over="ignore", invalid="ignore")  # numbers near the largest double may be among those that are not meant
def plausibility(loop: ClosedLoop, duration: float, start: list[float] | None) -> tuple[Advice, ...]:
    """Advice for each thing that is surely not meant.

    Args:
        loop: of the scenario.
        duration: of the run, s.
        start: initial position, one entry per output, m and rad; None for zero.
    """
    desired = _desired(loop, duration, start)
    all_advice = [*_angles(loop, desired), *_unfinished(loop.reference, desired)]
    if isinstance(loop.plant, HybridVehicle):
        all_advice += [*_above(loop, desired), *_too_fast(loop, loop.plant, desired)]
    return tuple(all_advice)


def start_and_angles(loop: ClosedLoop, duration: float, start: list[float] | None) -> tuple[Advice, ...]:
    """Of `plausibility`, for the same arguments, what is said of angles and of a path that begins elsewhere."""
    desired = _desired(loop, duration, start)
    elsewhere = _begins_elsewhere(desired) if isinstance(loop.plant, HybridVehicle) else ()
    return (*_angles(loop, desired), *elsewhere)


def top_speed(plant: HybridVehicle) -> float:
    """Speed through the water, m/s, that the thrusters exceed in no direction; infinite where they have no limit.

    In a direction the force is at most the sum of what each thruster gives, and the surplus of weight or buoyancy,
    although these also turn the vehicle and push it sideways. Drag balances that force at the speed.
    """
    thrusts = _thrusts(plant)
    if thrusts is None:
        return np.inf
    low, high = thrusts
    along = _sphere(_DIRECTIONS)
    shares = along @ np.asarray(plant.thruster_matrix, dtype=float)[:3]
    body = plant.body
    surplus = abs(float(body.weight) - float(body.buoyancy))
    force = np.maximum(low * shares, high * shares).sum(axis=1) + surplus
    linear, quadratic = (
        np.asarray(damping, dtype=float)[:3, :3] for damping in (body.linear_damping, body.quadratic_damping)
    )
    a = np.einsum("ki,ij,kj->k", along, linear, along)
    b = np.einsum("ki,ij,kj->k", along, quadratic, along * np.abs(along))
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = 2 * force / (a + np.sqrt(a**2 + 4 * b * force))  # a v + b v^2 = force
    return float(np.where(np.isnan(speed), np.inf, speed).max())


def held_speed(plant: HybridVehicle, position: Float[np.ndarray, " 6"], flow: Float[np.ndarray, " 3"]) -> float:
    """Speed of a current, m/s and at most that of `flow`, against which the thrusters hold the vehicle where it is.

    Damping, the moment of the added mass and the surplus of weight or buoyancy are balanced along all directions in
    which the thrusters act; along the others nothing is.

    Args:
        plant: vehicle with thrusters.
        position: that is held, m and rad.
        flow: velocity of the current, world axes, m/s.
    """
    thrusts = _thrusts(plant)
    if thrusts is None or not flow.any():
        return _size(flow)
    (rotation,) = rotations(position[None, 3:])
    shares = np.linspace(0.0, 1.0, _SHARES)
    relative_velocity = np.concatenate([-rotation.T @ flow, np.zeros(3)])
    matrix = np.asarray(plant.thruster_matrix, dtype=float)
    down = np.broadcast_to(rotation[2], (_SHARES, 3))
    needed = np.asarray(body_force(plant.body, np.outer(shares, relative_velocity), down)) @ acting_directions(plant).T
    speed = 0.0
    for share, force in zip(shares, needed, strict=True):
        residual = matrix @ _nearest_thrusts(matrix, force, *thrusts) - force
        if _size(residual) > _BALANCED * _size(force):
            break
        speed = float(share * _size(flow))
    return speed


def _nearest_thrusts(matrix: np.ndarray, force: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Thrusts between their limits whose force is nearest to a given one."""
    unlimited = np.linalg.lstsq(matrix, force)[0]
    if ((low <= unlimited) & (unlimited <= high)).all():
        return unlimited
    from scipy.optimize import lsq_linear  # a fifth of a second, which vehicles with thrust to spare need not wait for

    return lsq_linear(matrix, force, bounds=(low, high)).x


def _thrusts(plant: HybridVehicle) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]] | None:
    """Lowest and highest steady thrusts, N; None where there is no limit, or none is known."""
    limits = _steady_range(plant)
    if limits is None:
        return None
    low, high = (np.asarray(limit, dtype=float) for limit in limits)
    return (low, high) if np.isfinite(low).all() and np.isfinite(high).all() else None


@briefly_compiled
def _steady_range(plant: HybridVehicle):
    actuators = plant.thruster.actuator_model(plant.inputs(), False)
    if actuators.time_constant() is None:  # the steady force is unknown, too
        return None
    held = actuators.quasi_static()
    return held.range(held.init(), jnp.ones(()))


def _size(vector: Float[np.ndarray, " k"]) -> float:
    """Euclidean norm, also of entries whose squares are too large for a double."""
    return float(np.hypot.reduce(vector))


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
    late_samples = _sampled(reference, np.geomspace(duration, max(_LONG, 2 * duration), _SAMPLES), desired.start)
    if not np.isfinite(late_samples.position).all():
        return
    goal = late_samples.position[-1]
    size = 1e-9 * np.ptp(late_samples.position, axis=0).max()
    arrived = np.abs(late_samples.position - goal).max(axis=1) <= size
    if arrived.all() or not arrived[-2:].all() or late_samples.velocity[-2:].any() or size == 0:
        return
    last = int(np.flatnonzero(~arrived)[-1])
    times = np.linspace(late_samples.time[last], late_samples.time[last + 1], _SAMPLES)
    samples_between = _sampled(reference, times, desired.start)
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


def _too_fast(loop: ClosedLoop, plant: HybridVehicle, desired: ReferenceSamples):
    """Speeds and distances beyond the thrusters."""
    top = top_speed(plant)
    if not np.isfinite(top):
        yield from _begins_elsewhere(desired)
        return
    flows = [current.velocity for current in _members(loop, Current)] + [
        current.mean for current in _members(loop, GaussMarkovCurrent)
    ]
    flow = np.sum([np.asarray(velocity, dtype=float) for velocity in flows], axis=0) if flows else np.zeros(3)
    current_speed = _size(flow)
    most = f"the thrusters give the vehicle at most {top:.3g} m/s through the water"
    if current_speed > _SPARE * top:
        message = f"the current is {current_speed:.3g} m/s, but {most}: it drifts away"
        yield advice("disturbance", message, "1 knot is 0.514 m/s")
        return
    ends_at_rest = _size(desired.velocity[-1, :3]) < _AT_REST
    held = held_speed(plant, desired.position[-1], flow) if ends_at_rest else current_speed
    if held < current_speed:
        message = (
            f"the current is {current_speed:.3g} m/s, but at the attitude of `reference` the thrusters hold the "
            f"vehicle against at most {held:.3g} m/s of it: it drifts away"
        )
        yield advice("disturbance", message, "1 knot is 0.514 m/s")
        return
    speed = float(np.hypot.reduce(desired.velocity[:, :3], axis=1).max())
    duration = float(desired.time[-1])
    displacements = desired.position[:, :3] - desired.start[:3]
    final_distance, initial_distance = _size(displacements[-1]), _size(displacements[0])
    if speed > _SPARE * (top + current_speed):
        yield advice("reference", f"`reference` moves at up to {speed:.3g} m/s, but {most}", "Make it slower")
    elif final_distance > _SPARE * (top + current_speed) * duration:
        message = f"`reference` is {final_distance:.4g} m from the start at the end of the run, but {most}"
        hint = f"That takes {final_distance / top:.3g} s: give `loop.duration` more than {duration:g} s"
        yield advice("reference", message, hint)
    elif initial_distance > _FAR * top:
        message = f"`reference` begins {initial_distance:.4g} m from the vehicle, but {most}"
        hint = "Set `initial.position`, or approach smoothly (`settling` of a setpoint)"
        at_limits = f"the thrusters are at their limits for {initial_distance / top:.3g} s or more"
        yield advice("reference", f"{message}: {at_limits}", hint)
    else:
        yield from _begins_elsewhere(desired)
        yield from _too_demanding(loop, plant, duration, flow, (speed + current_speed) / top)
        yield from _leans(plant, desired, flow)


def _too_demanding(loop: ClosedLoop, plant: HybridVehicle, duration: float, flow: np.ndarray, effort: float):
    """A motion that takes more than the thrusters have, in the current; `effort` is its speed over the top speed."""
    if effort < _EASY:
        return
    reserve = reference_reserve(plant.model(), loop.reference, duration, flow, samples=_LOOKS, enough=_SPARE)
    if reserve.share < 1:
        message = (
            f"the thrusters have {100 * reserve.share:.0f} % of what `reference` takes in this current at "
            f"{reserve.time:.3g} s: the vehicle falls behind"
        )
        yield advice("reference", message, "Make it slower")


def _leans(plant: HybridVehicle, desired: ReferenceSamples, flow: np.ndarray):
    """A vehicle that the water turns over about an axis that its thrusters cannot turn it about."""
    relative_velocity = desired.velocity[:, :3] - flow
    if not relative_velocity.any():
        return
    lean = largest_lean(plant, desired.position[:, 3:], relative_velocity)
    if lean is None or lean.angle <= _LEANS:
        return
    angle = f"by {np.degrees(lean.angle):.0f} degrees" if np.isfinite(lean.angle) else "until it turns over"
    message = (
        f"the thrusters cannot {lean.axis} the vehicle, and its weight and buoyancy right it too little: at "
        f"{desired.time[lean.row]:.3g} s, at {_size(relative_velocity[lean.row]):.2g} m/s through the water, it leans "
        f"{angle}"
    )
    yield advice("reference", message, "Make it slower, or lower the centre of gravity")


def _begins_elsewhere(desired: ReferenceSamples):
    """A path whose first point is not where the vehicle starts. A constant position is a step that is meant."""
    first, start = desired.position[0], desired.start
    distance = _size(first[:3] - start[:3])
    if distance <= _JUMP or not np.ptp(desired.position[:, :3], axis=0).any():
        return
    listed = lambda values: f"[{', '.join(f'{value:.4g}' for value in values)}]"
    message = (
        f"`reference` begins {distance:.4g} m from the vehicle: at {listed(first[:3])} m (north, east, down), but the "
        f"vehicle starts at {listed(start[:3])} m"
    )
    hint = f"Begin the path where the vehicle is, or write `initial: {{position: {listed(first)}}}`"
    yield advice("reference", message, hint)


def _members(loop: ClosedLoop, kind: type) -> list:
    """The disturbances of a kind."""
    members = loop.disturbance.members if isinstance(loop.disturbance, SumOfDisturbances) else (loop.disturbance,)
    return [disturbance for disturbance in members if isinstance(disturbance, kind)]


def _desired(loop: ClosedLoop, duration: float, start: list[float] | None) -> ReferenceSamples:
    at_start, _ = loop.outputs_at_start(start, None)
    return _sampled(loop.reference, np.linspace(0.0, duration, _SAMPLES), np.asarray(at_start, dtype=float))


def _sampled(reference: AbstractReference, time: np.ndarray, start: np.ndarray) -> ReferenceSamples:
    at = _targets(reference, as_array(time))
    return ReferenceSamples(time, np.asarray(at.position, dtype=float), np.asarray(at.velocity, dtype=float), start)


@briefly_compiled
def _targets(reference: AbstractReference, times):
    return jax.lax.map(reference.at, times)


def _sphere(count: int) -> Float[np.ndarray, "count 3"]:
    """Unit vectors, evenly over the sphere (Fibonacci lattice), and the axes."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - z**2)
    spiral = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
    return np.concatenate([spiral, np.eye(3), -np.eye(3)])
