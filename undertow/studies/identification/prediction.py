"""The motion of a vehicle over segments of dives, and how it differs from what was measured."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import (
    attitude_error,
    quaternion_of_turn,
    quaternion_product,
    rotation_from_quaternion,
)
from undertow.studies.identification.identified_vehicle import IdentifiedVehicle, MotionState, Push


class Sensing(NamedTuple):
    """What lies between a vehicle and its log.

    Attributes:
        command_delay: s, from an input to what it does; negative where the times of inputs are late.
        current: of the water, world, m/s.
        rate_bias: of the angular velocity, rad/s.
    """

    command_delay: Float[Array, ""]
    current: Float[Array, "3"]
    rate_bias: Float[Array, "3"]


def residuals(
    vehicle: IdentifiedVehicle, sensing: Sensing, change: Float[Array, "12"], segment: Any, step: Float[Array, ""]
) -> Float[Array, "length 13"]:
    """Predicted less measured, at the times of the samples; m, rad, m/s, rad/s, m. Without a sample: any number.

    Where a filter follows the motion: its white innovations, which begin at the guess.

    Args:
        vehicle: with the numbers of the estimate.
        sensing: what lies between it and the log.
        change: of the guessed motion at the begin of the segment: m, rad (a turn in body axes), m/s, rad/s.
        segment: one of `Segments`.
        step: s.
    """
    if segment.gains is not None:
        return innovations(vehicle, sensing, segment, step)
    states, rates_before, rates_after = motion(vehicle, sensing, change, segment, step)
    before = jax.tree.map(lambda leaf: leaf[:-1], states)
    after = jax.tree.map(lambda leaf: leaf[1:], states)
    early = jax.tree.map(lambda a, b, rate: early_curve(a, b, step * rate), before, after, rates_before)
    late = jax.tree.map(lambda a, b, rate: late_curve(a, b, step * rate), before, after, rates_after)
    in_axes = (0, 0, 0, 0, 0, 0, 0, None, None)
    measured = (segment.values, segment.offsets, segment.spreads)
    return jax.vmap(_differences, in_axes)(before, after, early, late, *measured, sensing.rate_bias, step)


def motion(
    vehicle: IdentifiedVehicle, sensing: Sensing, change, segment: Any, step
) -> tuple[MotionState, MotionState, MotionState]:
    """States at the begin of each step of a segment and at its end, and derivatives at begin and end of each step.

    Inputs jump from step to step, so that the derivative at the end of one is not that at the begin of the next.
    Actuators are left out.
    """
    guess, inputs = begin(vehicle, sensing, segment, step)
    start = moved(guess, change)

    def advance(x: MotionState, u):
        after, rate_before, rate_after = one_step(vehicle, sensing, x, u, step)
        return after, tuple(one._replace(actuators=()) for one in (after, rate_before, rate_after))

    _, (after, rates_before, rates_after) = jax.lax.scan(advance, start, inputs)
    first = start._replace(actuators=())
    states = jax.tree.map(lambda one, others: jnp.concatenate([one[None], others]), first, after)
    return states, rates_before, rates_after


def innovations(vehicle: IdentifiedVehicle, sensing: Sensing, segment: Any, step) -> Float[Array, "length 13"]:
    """What each measurement says that a filter with given gains did not expect, whitened; see `Segments`."""
    start, inputs = begin(vehicle, sensing, segment, step)

    def advance(x: DisturbedMotion, row):
        u, measured, gain, whitening = row
        after, difference = step_and_difference(vehicle, sensing, x, u, measured, segment.push_kept, step)
        return disturbed(after, -matvec(gain, difference)), matvec(whitening, difference)

    measured = (segment.values, segment.offsets, segment.spreads)
    first = DisturbedMotion(start, jnp.zeros(6))
    _, white = jax.lax.scan(advance, first, (inputs, measured, segment.gains, segment.whitening))
    return white


class DisturbedMotion(NamedTuple):
    """A motion, and what pushes the vehicle besides its thrusters: a further acceleration, m/s^2 and rad/s^2, (6,)."""

    motion: MotionState
    push: Float[Array, "6"]


def step_and_difference(
    vehicle: IdentifiedVehicle, sensing: Sensing, x: DisturbedMotion, u, measured, push_kept, step
) -> tuple[DisturbedMotion, Float[Array, "13"]]:
    """The state after a step, of whose push a share is kept, and predicted less measured in the step."""
    after, rate_before, rate_after = one_step(vehicle, sensing, x.motion, u, step, x.push)
    plain, plain_after = x.motion._replace(actuators=()), after._replace(actuators=())
    curve = lambda rule, rate: jax.tree.map(
        lambda a, b, slope: rule(a, b, step * slope), plain, plain_after, rate._replace(actuators=())
    )
    early, late = curve(early_curve, rate_before), curve(late_curve, rate_after)
    values, offsets, spreads = measured
    difference = _differences(plain, plain_after, early, late, values, offsets, spreads, sensing.rate_bias, step)
    return DisturbedMotion(after, push_kept * x.push), difference


def begin(vehicle: IdentifiedVehicle, sensing: Sensing, segment: Any, step) -> tuple[MotionState, Any]:
    """The guessed motion at the begin of a segment, with actuators that have run in, and the inputs from then on."""
    inputs = delayed(segment.inputs, sensing.command_delay / step)
    before = segment.inputs.shape[0] - segment.values.shape[0]

    def run_in(state, u):
        return vehicle.actuators_after(state, u, step), None

    actuators, _ = jax.lax.scan(run_in, vehicle.actuation.initial_state(), inputs[:before])
    guess = segment.start
    return MotionState(guess[:3], guess[3:7], guess[7:], actuators), inputs[before:]


def one_step(vehicle: IdentifiedVehicle, sensing: Sensing, x: MotionState, u, step, push: Push = 0.0):
    """The state after a step, and the derivatives at its begin and at its end."""
    rate_before = vehicle.dynamics(x, u, sensing.current, push)
    after = vehicle.advance(x, u, sensing.current, step, push)
    return after, rate_before, vehicle.dynamics(after, u, sensing.current, push)


def moved(x: MotionState, change: Float[Array, "12"]) -> MotionState:
    """A motion with a change: m, rad (a turn in body axes), m/s, rad/s."""
    return x._replace(
        position=x.position + change[:3],
        attitude=quaternion_product(x.attitude, quaternion_of_turn(change[3:6])),
        nu=x.nu + change[6:],
    )


def disturbed(x: DisturbedMotion, change: Float[Array, "18"]) -> DisturbedMotion:
    """The same with a change of the motion, and of the push."""
    return DisturbedMotion(moved(x.motion, change[:12]), x.push + change[12:])


def between(x: DisturbedMotion, other: DisturbedMotion) -> Float[Array, "18"]:
    """The small change that leads from one to another: the inverse of `disturbed`."""
    turn = attitude_error(other.motion.attitude, x.motion.attitude)
    moves = (other.motion.position - x.motion.position, turn, other.motion.nu - x.motion.nu)
    return jnp.concatenate([*moves, other.push - x.push])


def delayed(inputs: Float[Array, "steps N"], steps: Float[Array, ""]) -> Float[Array, "steps N"]:
    """Mean inputs of each step, when all come later by a number of steps; earlier where it is negative."""
    whole = jnp.floor(jax.lax.stop_gradient(steps))
    part = steps - whole
    index = jnp.arange(inputs.shape[0]) - whole.astype(int)
    earlier = lambda k: jnp.asarray(inputs)[jnp.clip(index - k, 0, inputs.shape[0] - 1)]
    return (1 - part) * earlier(0) + part * earlier(1)


def early_curve(begin, end, change):
    """Second derivative of a cubic at the begin of a step, by the derivative there; both times the step's powers."""
    return 2 * (end - begin - change)


def late_curve(begin, end, change):
    """The same at the end of the step, by the derivative there."""
    return 2 * (change - (end - begin))


def on_cubic(begin, end, early, late, share, spread=0.0):
    """Mean of samples in a step, at a mean share of it with a variance, on the cubic with these second derivatives.

    That is exact for one sample, and for a parabola. Arrays of JAX and NumPy go through.
    """
    below_chord = 0.5 * (share - share**2 - spread)
    return (1 - share) * begin + share * end - below_chord * ((1 - share) * early + share * late)


def _differences(
    before: MotionState,
    after: MotionState,
    early: MotionState,
    late: MotionState,
    measured,
    offsets,
    spreads,
    rate_bias,
    step,
) -> Float[Array, "13"]:
    """Of one step, whose samples were taken between two states.

    The mean of samples differs from the value at their mean time where the motion is curved. `early` and `late` are
    its second derivatives, times the square of the step, by the derivative at the begin and at the end of the step: a
    cubic through both states with both derivatives has the one at the begin, the other at the end, and their mean
    between, weighted with the time.
    """
    curved = lambda sensor, of: (1 - offsets[sensor]) * of(early) + offsets[sensor] * of(late)

    def blend(sensor: int, of):
        return on_cubic(of(before), of(after), of(early), of(late), offsets[sensor], spreads[sensor])

    position = lambda x: x.position
    placed = _place(before, after, offsets[0], step) + 0.5 * spreads[0] * curved(0, position)
    quaternion = blend(1, lambda x: x.attitude)
    quaternion = quaternion / jnp.sqrt((quaternion * quaternion).sum())
    down = _place(before, after, offsets[4], step)[2] + 0.5 * spreads[4] * curved(4, position)[2]
    return jnp.concatenate(
        [
            placed - measured[:3],
            attitude_error(quaternion, measured[3:7]),
            blend(2, lambda x: x.nu[:3]) - measured[7:10],
            blend(3, lambda x: x.nu[3:]) + rate_bias - measured[10:13],
            (down - measured[13])[None],
        ]
    )


def _place(before: MotionState, after: MotionState, share, step) -> Float[Array, "3"]:
    """Position within a step: the cubic through both positions with both velocities."""
    travel = lambda x: step * matvec(rotation_from_quaternion(x.attitude), x.nu[:3])
    square, cube = share**2, share**3
    return (
        (2 * cube - 3 * square + 1) * before.position
        + (3 * square - 2 * cube) * after.position
        + (cube - 2 * square + share) * travel(before)
        + (cube - square) * travel(after)
    )
