"""Robust modifications of an adaptive law: leakage, e-modification and dead zone, Ioannou and Sun (1996), ch. 8."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.param import Param, param

Weights = Float[Array, "n rules"]


class RobustModification(eqx.Module):
    """theta_dot = Eq. (44) - gamma (kappa + nu |eps|) theta; the part of Eq. (44) is 0 where |eps| < the dead zone.

    Each is one number for all axes or one per axis. Sections 3.8 and X2 of the theory.

    Raises:
        BadInput: a value negative.
    """

    leakage: Float[Param, "..."] = param("", "of the sigma-modification", symbol="kappa")
    e_modification: Float[Param, "..."] = param("s/m, s/rad", "factor of |eps|", symbol="nu")
    dead_zone: Float[Param, "..."] = param("m/s, rad/s", "largest |eps| that is treated as noise")

    def __check_init__(self):
        for name in ("leakage", "e_modification", "dead_zone"):
            checks.not_negative(name, getattr(self, name))

    def rate(
        self, rate: Weights, adaptation: Float[Array, "..."], error: Float[Array, " n"], weights: Weights
    ) -> Weights:
        """theta_dot with the modifications, m/s^3 and rad/s^3.

        Args:
            rate: of Eq. (44).
            adaptation: gamma, 1/s^2.
            error: eps, m/s and rad/s.
            weights: theta, m/s^2 and rad/s^2.
        """
        size = jnp.abs(error)
        adaptive_rate = jnp.where((size < self.dead_zone)[:, None], 0.0, rate)
        return adaptive_rate - (adaptation * (self.leakage + self.e_modification * size))[:, None] * weights


def modification_of(leakage, e_modification, dead_zone) -> RobustModification | None:
    """Modification with these values; None, which costs nothing, where all of them are zero."""
    values = (leakage, e_modification, dead_zone)
    if not any(checks.assumed(lambda number: (number != 0).any(), value) for value in values):
        return None
    return RobustModification(*values)
