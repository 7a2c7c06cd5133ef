"""The textbook's linear extended-state observer with state feedback (ADRC, or a PI observer): no fuzzy sets."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.controllers.signals import ESTIMATE, MODELLING_ERROR
from undertow.core.contracts import AbstractController, Measurement, Model, Target
from undertow.core.param import param
from undertow.numerics.linear import matvec


class ObserverState(NamedTuple):
    """What is believed: velocity (m/s, rad/s) and disturbance (m/s^2, rad/s^2)."""

    rates: Float[Array, " n"]
    estimate: Float[Array, " n"]


class LinearObserver(AbstractController):
    """v_hat_dot = F + G u + d_hat - pole eps, d_hat_dot = -stiffness eps, by Euler's method as the paper's law is."""

    model: Model
    pole: Float[Array, ""] = param("1/s", "correction of the velocity, beta_1")
    stiffness: Float[Array, ""] = param("1/s^2", "correction of d_hat, beta_2")
    feedback: Float[Array, "2"] = param("1/s^2, 1/s", "state feedback", symbol="K")

    def init(self, y: Measurement, r: Target) -> ObserverState:
        rates = self.model.coordinates.velocity(y)
        return ObserverState(rates, jnp.zeros_like(rates))

    def command(self, z: ObserverState, y: Measurement, r: Target):
        model = self.model
        error, rate, acceleration = model.coordinates.tracking_error(y, r)
        demand = acceleration + self.feedback[0] * error + self.feedback[1] * rate
        signals = {"estimate": z.estimate, "modelling_error": z.rates - model.coordinates.velocity(y)}
        return model.dynamics.invert(y, demand - z.estimate - model.dynamics.drift(y)), signals

    def signals(self):
        return ESTIMATE | MODELLING_ERROR

    def advance(self, z: ObserverState, y: Measurement, r: Target, u_applied, dt) -> ObserverState:
        eps = z.rates - self.model.coordinates.velocity(y)
        known = self.model.dynamics.drift(y) + matvec(self.model.dynamics.gain(y), u_applied)
        return ObserverState(
            z.rates + dt * (known + z.estimate - self.pole * eps), z.estimate - dt * self.stiffness * eps
        )
