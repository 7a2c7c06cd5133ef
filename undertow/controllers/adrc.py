"""Active disturbance rejection: a linear extended-state observer and state feedback."""

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


class ObserverState(NamedTuple):
    """State z: the estimates of the observer."""

    rates: PerAxis  # m/s, rad/s
    estimate: PerAxis  # d_hat, m/s^2, rad/s^2


class ADRC(AbstractInformedController):
    """v_hat_dot = F + G u + d_hat - 2 zeta w_o eps and d_hat_dot = -w_o^2 eps, with eps = v_hat - v, by Euler's method.

    The input gives x_ddot_d + k_1 e + k_2 e_dot - d_hat. The observer uses the applied input, so limits cause no
    windup.

    Raises:
        BadInput: bandwidth or damping not positive, or feedback not Hurwitz.
    """

    model: Model
    bandwidth: Float[Param, "..."] = param("rad/s", "natural frequency of the observer", symbol="w_o")
    damping: Float[Param, "..."] = param("", "damping ratio of the observer", symbol="zeta")
    feedback: Float[Param, "*#n 2"] = param("1/s^2, 1/s", "state feedback", symbol="K")

    def __check_init__(self):
        checks.positive("bandwidth", self.bandwidth, "rad/s")
        checks.positive("damping", self.damping)
        per_axis = {"bandwidth": self.bandwidth, "damping": self.damping}
        check_gains(self.feedback, jnp.eye(2), per_axis, len(self.model.coordinates.angles))

    def init(self, y: Measurement, r: Target) -> ObserverState:
        rates = self.model.coordinates.velocity(y)
        return ObserverState(rates, jnp.zeros_like(rates))

    def command(self, z: ObserverState, y: Measurement, r: Target):
        model = self.model
        demand = demanded_acceleration(model.coordinates, self.feedback, y, r)
        signals = {"estimate": z.estimate, "modelling_error": z.rates - model.coordinates.velocity(y)}
        forces = model.dynamics.invert(y, demand - z.estimate - model.dynamics.drift(y))
        return input_for(model.actuators, forces), signals

    def known_acceleration(self, z, y: Measurement, u_applied) -> PerAxis:
        return modelled_acceleration(self.model, y, u_applied)

    def signals(self):
        return ESTIMATE | MODELLING_ERROR

    def advance(self, z: ObserverState, y: Measurement, r: Target, u_applied, dt) -> ObserverState:
        eps = z.rates - self.model.coordinates.velocity(y)
        known = self.known_acceleration(z, y, u_applied)
        return ObserverState(
            z.rates + dt * (known + z.estimate - 2 * self.damping * self.bandwidth * eps),
            z.estimate - dt * self.bandwidth**2 * eps,
        )


def adrc(model: Model, *, bandwidth=20.0, damping=1.0, feedback=(1.0, 2.0)) -> ADRC:
    """Active disturbance rejection control (ADRC): Han (2009), with the bandwidths of Gao (2003). Body axes.

    Args:
        model: nominal model, from `plant.model()`.
        bandwidth: natural frequency of the extended-state observer, rad/s; one number or one per axis. Below half of
            the sampling rate and the bandwidth of the actuators.
        damping: its damping ratio; one number or one per axis.
        feedback: K = (k1, k2), 1/s^2 and 1/s; one pair or one per axis.

    Raises:
        BadInput: a value is out of its range.
    """
    return ADRC(model=model.in_body_axes(), bandwidth=bandwidth, damping=damping, feedback=feedback)
