"""The tracking error that is allowed: a limit, and what jumps of the reference and the start add, which decays."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.supervision.motion import length
from undertow.core import checks
from undertow.core.contracts import AbstractCoordinates, Measurement, Target
from undertow.core.param import Param, param

Scalar = Float[Array, ""]


class AllowanceState(NamedTuple):
    """What is allowed beyond the limits."""

    position: Float[Array, ""]  # m
    angle: Float[Array, ""]  # rad


class TrackingAllowance(eqx.Module):
    """Limits of the tracking error, and how fast what is allowed beyond them decays.

    Raises:
        BadInput: a limit is not positive.
    """

    max_position_error: Float[Param, ""] = param("m", "tracking error that is always allowed")
    max_angle_error: Float[Param, ""] = param("rad", "the same of the attitude, or of angles")
    seconds: Float[Param, ""] = param("s", "time in which an allowance of the size of the limit decays")

    def __check_init__(self):
        for name in ("max_position_error", "max_angle_error", "seconds"):
            checks.positive(name, getattr(self, name), finite=False)

    def start(self, coordinates: AbstractCoordinates, y: Measurement, r: Target) -> AllowanceState:
        """What the error at the start adds."""
        return AllowanceState(*_sizes(coordinates, coordinates.tracking_error(y, r).error))

    def after(
        self,
        state: AllowanceState,
        coordinates: AbstractCoordinates,
        y: Measurement,
        targets: tuple[Target, Target],
        dt: Scalar,
    ) -> AllowanceState:
        """One step later, with the reference as it was and is; never more than the present error needs."""
        before, r = targets
        jump = coordinates.difference(r.position, before.position) - dt * before.velocity
        decayed = (
            jnp.maximum(0.0, allowance - dt * limit / self.seconds)
            for allowance, limit in zip(state, (self.max_position_error, self.max_angle_error), strict=True)
        )
        jumped = (allowance + size for allowance, size in zip(decayed, _sizes(coordinates, jump), strict=True))
        return AllowanceState(*map(jnp.minimum, jumped, self.start(coordinates, y, r)))

    def ratios(
        self, state: AllowanceState, coordinates: AbstractCoordinates, y: Measurement, r: Target
    ) -> tuple[Scalar, Scalar]:
        """Tracking errors of position and attitude relative to the allowed ones."""
        position, angle = _sizes(coordinates, coordinates.tracking_error(y, r).error)
        return (position / (self.max_position_error + state.position), angle / (self.max_angle_error + state.angle))


def _sizes(coordinates: AbstractCoordinates, difference: Array) -> tuple[Scalar, Scalar]:
    """Lengths of the parts of a difference that are lengths and angles."""
    turns = np.array(coordinates.angles)
    return tuple(length(difference * jnp.asarray(mask, dtype=float)) for mask in (~turns, turns))  # pyright: ignore[reportReturnType] - two of them
