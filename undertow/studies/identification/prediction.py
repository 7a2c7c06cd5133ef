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
from undertow.studies.identification.identified_vehicle import IdentifiedVehicle, MotionState


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
    vehicle: IdentifiedVehicle,
    sensing: Sensing,
    change: Float[Array, "12"],
    segment: Any,
    step: Float[Array, ""],
    substeps: int = 1,
) -> Float[Array, "length 13"]:
    """Predicted less measured, at the times of the samples; m, rad, m/s, rad/s, m. Without a sample: any number.

    Args:
        vehicle: with the numbers of the estimate.
        sensing: what lies between it and the log.
        change: of the guessed motion at the begin of the segment: m, rad (a turn in body axes), m/s, rad/s.
        segment: one of `Segments`.
        step: s.
        substeps: of the integration in each step.
    """
    states = motion(vehicle, sensing, change, segment, step, substeps)
    return jax.vmap(_differences, (0, 0, 0, 0, None, None))(
        jax.tree.map(lambda leaf: leaf[:-1], states),
        jax.tree.map(lambda leaf: leaf[1:], states),
        segment.values,
        segment.offsets,
        sensing.rate_bias,
        step,
    )


def motion(vehicle: IdentifiedVehicle, sensing: Sensing, change, segment: Any, step, substeps: int = 1) -> MotionState:
    """States at the begin of each step of a segment and at its end, actuators left out (zero)."""
    inputs = delayed(segment.inputs, sensing.command_delay / step)
    length = segment.values.shape[0]
    before = segment.inputs.shape[0] - length

    def run_in(state, u):
        for _ in range(substeps):
            state = vehicle.actuators_after(state, u, step / substeps)
        return state, None

    actuators, _ = jax.lax.scan(run_in, vehicle.actuation.initial_state(), inputs[:before])

    def advance(x: MotionState, u):
        for _ in range(substeps):
            x = vehicle.advance(x, u, sensing.current, step / substeps)
        return x, x._replace(actuators=())

    guess = segment.start
    start = MotionState(
        position=guess[:3] + change[:3],
        attitude=quaternion_product(guess[3:7], quaternion_of_turn(change[3:6])),
        nu=guess[7:] + change[6:],
        actuators=actuators,
    )
    _, after = jax.lax.scan(advance, start, inputs[before:])
    first = start._replace(actuators=())
    return jax.tree.map(lambda one, others: jnp.concatenate([one[None], others]), first, after)


def delayed(inputs: Float[Array, "steps N"], steps: Float[Array, ""]) -> Float[Array, "steps N"]:
    """Mean inputs of each step, when all come later by a number of steps; earlier where it is negative."""
    whole = jnp.floor(jax.lax.stop_gradient(steps))
    part = steps - whole
    index = jnp.arange(inputs.shape[0]) - whole.astype(int)
    earlier = lambda k: jnp.asarray(inputs)[jnp.clip(index - k, 0, inputs.shape[0] - 1)]
    return (1 - part) * earlier(0) + part * earlier(1)


def _differences(before: MotionState, after: MotionState, measured, offsets, rate_bias, step) -> Float[Array, "13"]:
    """Of one step, whose samples were taken between two states."""
    position, attitude, velocity, rates, depth = offsets
    blend = lambda share, a, b: (1 - share) * a + share * b
    placed = _place(before, after, position, step)
    quaternion = blend(attitude, before.attitude, after.attitude)
    quaternion = quaternion / jnp.sqrt((quaternion * quaternion).sum())
    down = _place(before, after, depth, step)[2]
    return jnp.concatenate(
        [
            placed - measured[:3],
            attitude_error(quaternion, measured[3:7]),
            blend(velocity, before.nu[:3], after.nu[:3]) - measured[7:10],
            blend(rates, before.nu[3:], after.nu[3:]) + rate_bias - measured[10:13],
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
