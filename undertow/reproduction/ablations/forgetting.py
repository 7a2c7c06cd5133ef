"""Classical cures of parameter drift on the paper's law: leakage, e-modification, dead zone. Section 3.8."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.controllers.composite_law import RCAF
from undertow.core.contracts import (
    AbstractInformedController,
    Measurement,
    Model,
    Target,
    known_acceleration,
)
from undertow.core.param import param


class Forgetting(AbstractInformedController):
    """theta_dot = Eq. (44) - gamma (leakage + e_mod |eps|) theta, and no adaptation while |eps| < zone."""

    law: RCAF
    model: Model
    leakage: Float[Array, ""] = param("", "kappa of the sigma-modification, X2", default=0.0)
    e_mod: Float[Array, ""] = param("s/m, s/rad", "factor of |eps| in it", default=0.0)
    zone: Float[Array, ""] = param("m/s, rad/s", "largest modelling error that is taken for noise", default=0.0)

    def __init__(self, law: RCAF, leakage=0.0, e_mod=0.0, zone=0.0):
        self.law, self.model = law, law.model
        self.leakage, self.e_mod, self.zone = jnp.asarray(leakage), jnp.asarray(e_mod), jnp.asarray(zone)

    def init(self, y: Measurement, r: Target) -> Any:
        return self.law.init(y, r)

    def command(self, z: Any, y: Measurement, r: Target):
        return self.law.command(z, y, r)

    def signals(self):
        return self.law.signals()

    def advance(self, z: Any, y: Measurement, r: Target, u_applied, dt) -> Any:
        size = jnp.abs(self.law.identification.error(z.predicted_velocity, self.model.coordinates.velocity(y)))[:, None]
        after = self.law.advance(z, y, r, u_applied, dt)
        learnt = jnp.where(size < self.zone, z.weights, after.weights)
        forgotten = dt * self.law.adaptation * (self.leakage + self.e_mod * size) * z.weights
        return after._replace(weights=learnt - forgotten)

    def known_acceleration(self, z: Any, y: Measurement, u_applied):
        return known_acceleration(self.law, z, y, u_applied)
