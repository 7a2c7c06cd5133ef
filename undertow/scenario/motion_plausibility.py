"""Advice on motions, currents and waves that take more than the thrusters have, and on a late position.

Only what holds whatever the controller does is said: speeds are compared with one that no direction exceeds, and a
current with the one that the thrusters can balance.
"""

import numpy as np

from undertow.analysis.thrust_reserve import reference_reserve
from undertow.control.navigation.degraded import Degraded
from undertow.core.arrays import as_array
from undertow.core.errors import advice
from undertow.core.kept_programs import briefly_compiled
from undertow.physics.disturbances.current import Current
from undertow.physics.disturbances.gauss_markov_current import GaussMarkovCurrent
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.disturbances.waves import Waves
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.attainable_speed import held_speed, top_speed, vector_size
from undertow.scenario.reference_samples import ReferenceSamples
from undertow.scenario.unactuated_attitude import largest_lean
from undertow.simulation.loop.closed_loop import ClosedLoop

_SPARE = 1.05  # a speed is too large from this multiple of the top speed on
_JUMP = 1.0  # m from the vehicle; a path that begins farther away begins with an error of this size
_FAR = 10.0  # s at top speed; a longer step saturates the thrusters for long
_EASY, _LOOKS = 0.4, 41  # a motion through the water that is slower than this share of the top speed; instants
_AT_REST = 1e-3  # m/s
_LEANS = 1.0  # rad; less is the way of such a vehicle
_LATE = 0.05  # m that a late position may be off
_SELDOM = 0.05  # of the time in waves
_LARGEST_ORBIT = 3.0  # standard deviations; faster water is rarer than 1.2 % of the time


def motion_advice(loop: ClosedLoop, plant: HybridVehicle, desired: ReferenceSamples):
    """Advice on speeds and distances beyond the thrusters, and on positions that come late."""
    top = top_speed(plant)
    yield from _too_fast(loop, plant, desired, top)
    yield from _in_waves(loop, plant, desired, top)
    yield from _late_position(loop, desired)


def path_begins_elsewhere(desired: ReferenceSamples):
    """Advice on a path that does not begin where the vehicle starts. A constant position is a step that is meant."""
    first, start = desired.position[0], desired.start
    distance = vector_size(first[:3] - start[:3])
    if distance <= _JUMP or not np.ptp(desired.position[:, :3], axis=0).any():
        return
    listed = lambda values: f"[{', '.join(f'{value:.4g}' for value in values)}]"
    message = (
        f"`reference` begins {distance:.4g} m from the vehicle: at {listed(first[:3])} m (north, east, down), but the "
        f"vehicle starts at {listed(start[:3])} m"
    )
    hint = f"Begin the path where the vehicle is, or write `initial: {{position: {listed(first)}}}`"
    yield advice("reference", message, hint)


def _too_fast(loop: ClosedLoop, plant: HybridVehicle, desired: ReferenceSamples, top: float):
    """Speeds and distances beyond the thrusters; `top` is the speed that no direction exceeds, m/s."""
    if not np.isfinite(top):
        yield from path_begins_elsewhere(desired)
        return
    flows = [current.velocity for current in _members(loop, Current)] + [
        current.mean for current in _members(loop, GaussMarkovCurrent)
    ]
    flow = np.sum([np.asarray(velocity, dtype=float) for velocity in flows], axis=0) if flows else np.zeros(3)
    current_speed = vector_size(flow)
    most = f"the thrusters give the vehicle at most {top:.3g} m/s through the water"
    if current_speed > _SPARE * top:
        message = f"the current is {current_speed:.3g} m/s, but {most}: it drifts away"
        yield advice("disturbance", message, "1 knot is 0.514 m/s")
        return
    ends_at_rest = _ends_at_rest(desired)
    held = held_speed(plant, desired.position[-1], flow) if ends_at_rest else current_speed
    if held < current_speed:
        message = (
            f"the current is {current_speed:.3g} m/s, but at the attitude of `reference` the thrusters hold the "
            f"vehicle against at most {held:.3g} m/s of it: it drifts away"
        )
        yield advice("disturbance", message, "1 knot is 0.514 m/s")
        return
    speed = _largest_speed(desired)
    duration = float(desired.time[-1])
    displacements = desired.position[:, :3] - desired.start[:3]
    final_distance, initial_distance = vector_size(displacements[-1]), vector_size(displacements[0])
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
        yield from path_begins_elsewhere(desired)
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
        f"{desired.time[lean.row]:.3g} s, at {vector_size(relative_velocity[lean.row]):.2g} m/s through the water, it "
        f"leans {angle}"
    )
    yield advice("reference", message, "Make it slower, or lower the centre of gravity")


def _in_waves(loop: ClosedLoop, plant: HybridVehicle, desired: ReferenceSamples, top: float):
    """Waves whose water moves faster than the thrusters can hold the vehicle against.

    Both components of the orbital velocity, along the heading and vertically, are normal with the same deviation
    sigma, so that a speed U is exceeded for a share e^(-U^2 / (2 sigma^2)) of the time. Acceleration of the water and
    currents come on top.
    """
    all_waves = _members(loop, Waves) if _ends_at_rest(desired) else []
    position = desired.position[-1]
    for waves in all_waves:
        depth = max(float(waves.depth) + position[2], 0.0)
        deviation = float(_orbital_speed(waves, as_array(depth)))
        fastest = _LARGEST_ORBIT * deviation
        if fastest < _EASY * top:
            continue
        along = np.array([np.cos(float(waves.heading)), np.sin(float(waves.heading)), 0.0])
        directions = (along, -along, np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]))
        held = min(held_speed(plant, position, fastest * direction) for direction in directions)
        share = np.exp(-(held**2) / (2 * deviation**2))
        if held < fastest and share > _SELDOM:
            message = (
                f"for {100 * share:.0f} % of the time the water of the waves moves faster than the {held:.2g} m/s "
                f"against which the thrusters hold the vehicle at a depth of {depth:.3g} m: it is carried along"
            )
            yield advice("disturbance", message, "Go deeper, or reduce `height`")


@briefly_compiled
def _orbital_speed(waves: Waves, depth):
    return waves.orbital_speed(depth)


def _late_position(loop: ClosedLoop, desired: ReferenceSamples):
    """A delay after which the vehicle is elsewhere: it is ahead of its measured position by speed times delay."""
    if not isinstance(loop.navigation, Degraded):
        return
    delay = float(np.max(np.asarray(loop.navigation.position.delay)))
    speed = _largest_speed(desired)
    if speed * delay > _LATE:
        message = (
            f"positions come {delay:.3g} s late, in which the vehicle moves by up to {100 * speed * delay:.2g} cm: it "
            "is as far from the reference when its measured position is on it"
        )
        yield advice("navigation", message, "Use a navigation filter (`kalman`), or a slower reference")


def _largest_speed(desired: ReferenceSamples) -> float:
    """Of the target, m/s."""
    return float(np.hypot.reduce(desired.velocity[:, :3], axis=1).max())


def _ends_at_rest(desired: ReferenceSamples) -> bool:
    return vector_size(desired.velocity[-1, :3]) < _AT_REST


def _members(loop: ClosedLoop, kind: type) -> list:
    """The disturbances of a kind."""
    members = loop.disturbance.members if isinstance(loop.disturbance, SumOfDisturbances) else (loop.disturbance,)
    return [disturbance for disturbance in members if isinstance(disturbance, kind)]
