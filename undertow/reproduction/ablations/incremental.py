"""Incremental nonlinear dynamic inversion (INDI): the input is changed by what the acceleration lacks."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.controllers.signals import ESTIMATE, MODELLING_ERROR
from undertow.core.contracts import AbstractController, Measurement, Model, Target
from undertow.core.param import param
from undertow.numerics.linear import matvec


class FilterState(NamedTuple):
    """Two low passes H = b / (p^2 + a p + b): of the velocity and of what was known of the acceleration."""

    velocity: Float[Array, " n"]
    acceleration: Float[Array, " n"]  # its derivative
    known: Float[Array, " n"]
    known_rate: Float[Array, " n"]


class Incremental(AbstractController):
    """G u = wanted - (H x_ddot - H (F + G u)): no observer, no estimate; x_ddot is the filtered velocity's slope."""

    model: Model
    pole: Float[Array, ""] = param("1/s", "a of the filter")
    stiffness: Float[Array, ""] = param("1/s^2", "b of the filter")
    feedback: Float[Array, "2"] = param("1/s^2, 1/s", "state feedback", symbol="K")

    def init(self, y: Measurement, r: Target) -> FilterState:
        rates = self.model.coordinates.velocity(y)
        zero = jnp.zeros_like(rates)
        return FilterState(rates, zero, zero, zero)

    def command(self, z: FilterState, y: Measurement, r: Target):
        model, missing = self.model, z.acceleration - z.known
        error, rate, acceleration = model.coordinates.tracking_error(y, r)
        demand = acceleration + self.feedback[0] * error + self.feedback[1] * rate
        signals = {"estimate": missing, "modelling_error": z.velocity - model.coordinates.velocity(y)}
        return model.dynamics.invert(y, demand - missing - model.dynamics.drift(y)), signals

    def signals(self):
        return ESTIMATE | MODELLING_ERROR

    def advance(self, z: FilterState, y: Measurement, r: Target, u_applied, dt) -> FilterState:
        known = self.model.dynamics.drift(y) + matvec(self.model.dynamics.gain(y), u_applied)
        of_velocity = self.stiffness * (self.model.coordinates.velocity(y) - z.velocity) - self.pole * z.acceleration
        of_known = self.stiffness * (known - z.known) - self.pole * z.known_rate
        return FilterState(
            z.velocity + dt * z.acceleration,
            z.acceleration + dt * of_velocity,
            z.known + dt * z.known_rate,
            z.known_rate + dt * of_known,
        )
