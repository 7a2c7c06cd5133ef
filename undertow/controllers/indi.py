"""Incremental nonlinear dynamic inversion (INDI): the input changes by the error of the acceleration."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.controllers.law_signals import ESTIMATE, MODELLING_ERROR
from undertow.controllers.tracking_error import check_gains, demanded_acceleration, modelled_acceleration
from undertow.core import checks
from undertow.core.actuator_model import input_for
from undertow.core.contracts import AbstractInformedController, Measurement, Model, Target
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]


class FilterState(NamedTuple):
    """State z: the filters H of the velocity and of the modelled acceleration; SI units."""

    velocity: PerAxis
    acceleration: PerAxis  # its derivative
    known: PerAxis
    known_rate: PerAxis


class INDI(AbstractInformedController):
    """G u = x_ddot_d + k_1 e + k_2 e_dot - F - (H x_ddot - H (F + G u)): no observer of the load.

    H = w^2 / (p^2 + 2 zeta w p + w^2), by Euler's method; the acceleration is the slope of the filtered velocity. In
    continuous time this is ADRC of the same bandwidth.

    Raises:
        BadInput: bandwidth or damping not positive, or feedback not Hurwitz.
    """

    model: Model
    bandwidth: Float[Param, "..."] = param("rad/s", "natural frequency of the filter", symbol="w")
    damping: Float[Param, "..."] = param("", "damping ratio of the filter", symbol="zeta")
    feedback: Float[Param, "*#n 2"] = param("1/s^2, 1/s", "state feedback", symbol="K")

    def __check_init__(self):
        checks.positive("bandwidth", self.bandwidth, "rad/s")
        checks.positive("damping", self.damping)
        per_axis = {"bandwidth": self.bandwidth, "damping": self.damping}
        check_gains(self.feedback, jnp.eye(2), per_axis, len(self.model.coordinates.angles))

    def init(self, y: Measurement, r: Target) -> FilterState:
        rates = self.model.coordinates.velocity(y)
        zero = jnp.zeros_like(rates)
        return FilterState(rates, zero, zero, zero)

    def command(self, z: FilterState, y: Measurement, r: Target):
        model, missing = self.model, z.acceleration - z.known
        demand = demanded_acceleration(model.coordinates, self.feedback, y, r)
        signals = {"estimate": missing, "modelling_error": z.velocity - model.coordinates.velocity(y)}
        forces = model.dynamics.invert(y, demand - missing - model.dynamics.drift(y))
        return input_for(model.actuators, forces), signals

    def known_acceleration(self, z, y: Measurement, u_applied) -> PerAxis:
        return modelled_acceleration(self.model, y, u_applied)

    def signals(self):
        return ESTIMATE | MODELLING_ERROR

    def advance(self, z: FilterState, y: Measurement, r: Target, u_applied, dt) -> FilterState:
        known = self.known_acceleration(z, y, u_applied)
        velocity, acceleration = self._filtered(z.velocity, z.acceleration, self.model.coordinates.velocity(y), dt)
        return FilterState(velocity, acceleration, *self._filtered(z.known, z.known_rate, known, dt))

    def _filtered(self, value: PerAxis, slope: PerAxis, heading: PerAxis, dt) -> tuple[PerAxis, PerAxis]:
        """Output of H and its derivative one sampling time later."""
        pull = self.bandwidth**2 * (heading - value) - 2 * self.damping * self.bandwidth * slope
        return value + dt * slope, slope + dt * pull


def indi(model: Model, *, bandwidth=20.0, damping=1.0, feedback=(1.0, 2.0)) -> INDI:
    """Incremental nonlinear dynamic inversion: Sieberling, Chu and Mulder (2010), Smeur et al. (2016). Body axes.

    Args:
        model: nominal model, from `plant.model()`.
        bandwidth: natural frequency of the filter of velocity and input, rad/s; one number or one per axis. Below half
            of the sampling rate and the bandwidth of the actuators.
        damping: its damping ratio; one number or one per axis.
        feedback: K = (k1, k2), 1/s^2 and 1/s; one pair or one per axis.

    Raises:
        BadInput: a value is out of its range.
    """
    return INDI(model=model.in_body_axes(), bandwidth=bandwidth, damping=damping, feedback=feedback)
