"""Undetected thruster failures: given thrusters, or different ones for every seed."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractDisturbance, Load, ModelScaling
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.disturbances.adding import with_scaling


class ThrusterLoss(AbstractDisturbance):
    """From `start` on some thrusters give `remaining` times their thrust, unknown to model and allocation.

    Raises:
        BadInput: `start` or `number` negative.
    """

    remaining: Float[Param, ""] = param("", "share of the thrust that remains; 0 for off, -1 for reversed")
    start: Float[Param, ""] = param("s", "when they fail")
    number: Float[Param, ""] = param("", "number of randomly chosen thrusters that fail")
    failing: Float[Param, " N"] = param("", "1 for a thruster that fails in any case, else 0")

    def __check_init__(self):
        checks.not_negative("start", self.start, "s")
        checks.not_negative("number", self.number)

    def realize(self, key) -> Float[Array, " N"]:
        """Remaining share of each thruster's thrust."""
        chance = jax.random.uniform(key, self.failing.shape, dtype=self.remaining.dtype)
        rank = (chance[:, None] > chance[None, :]).sum(1)
        return jnp.where((rank < self.number.astype(int)) | (self.failing > 0), self.remaining, 1.0)

    def at(self, realization, t, pose, load: Load) -> Load:
        one = jnp.ones(())
        return with_scaling(load, pose, ModelScaling(one, one, one, jnp.where(t >= self.start, realization, 1.0)))

    def jumps(self, duration: float) -> tuple[float, ...]:
        return (float(self.start),) if 0 < float(self.start) < duration else ()


def thruster_loss(
    remaining: float = 0.0,
    start: float = 0.0,
    number: int = 1,
    failing: tuple[int, ...] | None = None,
    thrusters: int = 8,
) -> ThrusterLoss:
    """Undetected loss of thrusters.

    Args:
        remaining: share of the thrust that remains; 0 for off, -1 for reversed.
        start: when they fail, s.
        number: how many fail, different ones for every seed.
        failing: numbers, from 1, of the thrusters that fail, instead of `number`.
        thrusters: number of thrusters of the vehicle.

    Raises:
        BadInput: there are no such thrusters.
    """
    if not 0 <= number <= thrusters:
        raise BadInput("number", f"be from 0 to {thrusters}, as `thrusters` says", number)
    known = np.arange(1, thrusters + 1)
    if failing is not None and not np.isin(failing, known).all():
        raise BadInput("failing", f"have numbers from 1 to {thrusters}, as `thrusters` says", list(failing))
    chosen = np.zeros(thrusters) if failing is None else np.isin(known, failing).astype(float)
    return ThrusterLoss(remaining, start, number if failing is None else 0, chosen)
