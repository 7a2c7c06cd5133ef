"""Pose without a sensor of velocity: an observer differentiates the noisy pose."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.control.navigation.noise_only import AbstractNoiseOnly
from undertow.core import checks
from undertow.core.contracts import Measurement
from undertow.core.errors import BadInput
from undertow.core.measurement import with_outputs
from undertow.core.numerics.random_keys import numbered
from undertow.core.param import Param, param

ORDERS = (2, 3)


class PoseOnlyState(NamedTuple):
    """Estimates of the observer."""

    position: Float[Array, " n"]  # m, rad
    velocity: Float[Array, " n"]  # m/s, rad/s
    acceleration: Float[Array, " n"]  # m/s^2, rad/s^2; zero with order 2
    samples: Int[Array, ""]  # so far


class PoseOnly(AbstractNoiseOnly):
    """Observer of high gain (order 2), extended by the acceleration (order 3), with all poles at -w. No model is used.

    In continuous time with the innovation i = x_measured - x_hat of each output

        x_hat_dot = v_hat + 3 w i ,  v_hat_dot = a_hat + 3 w^2 i ,  a_hat_dot = w^3 i

    and with order 2 the same without a_hat, with gains 2 w and w^2. It is sampled with all poles at exp(-w T): the
    filter of fading memory of Morrison, Introduction to Sequential Smoothing and Prediction (1969), ch. 13. The
    velocity is late by 2 a / w at an acceleration a with order 2, and by 3 j / w^2 at a jerk j with order 3; white
    noise of the pose with standard deviation s gives it one of s (w^3 T / 4)^(1/2), or s (7 w^3 T / 4)^(1/2).

    A law takes v_hat for the velocity, so that its modelling error becomes eps + v - v_hat: with bounded acceleration
    or jerk the error of the observer is one more bounded part of the uncertainty, as long as the estimator of the law
    is slower than the observer. Khalil, High-Gain Observers in Nonlinear Feedback Control (2017), ch. 2 and 8.

    The observer starts at the true pose and at rest. Angles of a vehicle are compared the short way round.

    Raises:
        BadInput: noise negative, bandwidth or sampling time not positive, or an order other than 2 and 3; at the start
            of a run, not one number or one per output.
    """

    noise: Float[Param, "..."] = param("m, rad", "standard deviation of the pose")
    bandwidth: Float[Param, "..."] = param("rad/s", "poles of the observer", symbol="w")
    sampling_time: Float[Param, ""] = param("s", "time between readings", symbol="T")
    order: int = eqx.field(static=True, default=3)
    smooth: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        checks.not_negative("noise", self.noise)
        checks.positive("bandwidth", self.bandwidth, "rad/s")
        checks.positive("sampling_time", self.sampling_time, "s")
        if self.order not in ORDERS:
            raise BadInput("order", "be 2 (high gain) or 3 (extended)", self.order)

    def realize(self, key):
        return key

    def velocity_noise(self, dt):
        """Standard deviation of v_hat: closed forms of the filter of fading memory, at any w T.

        It is not white: the law that takes it for white expects more of it at low frequencies than there is.
        """
        pole = self._pole()
        if self.order == 2:
            gain = 2 * ((1 - pole) / (1 + pole)) ** 3
        else:
            gain = (13 + 50 * pole + 49 * pole**2) * (1 - pole) ** 3 / (2 * (1 + pole) ** 5)
        return self.noise * jnp.sqrt(gain) / self.sampling_time

    def init(self, realization, truth: Measurement) -> PoseOnlyState:
        for name in ("noise", "bandwidth"):
            checks.per_axis(name, getattr(self, name), len(truth.position))
        still = jnp.zeros_like(truth.position)
        return PoseOnlyState(truth.position, still, still, jnp.zeros((), dtype=int))

    def measure(self, realization, state: PoseOnlyState, t, truth: Measurement):
        error = jax.random.normal(numbered(realization, state.samples), truth.position.shape, truth.position.dtype)
        read = truth.position + self.noise * error
        new = self._corrected(self._predicted(state), read, truth.body is not None)
        new = new._replace(samples=state.samples + 1)
        return with_outputs(truth, new.position, new.velocity), new

    def _predicted(self, state: PoseOnlyState) -> PoseOnlyState:
        """One sampling time later, at constant acceleration; the first reading comes at once."""
        dt = jnp.where(state.samples > 0, self.sampling_time, 0.0)
        velocity = state.velocity + dt * state.acceleration
        return state._replace(position=state.position + dt * (state.velocity + velocity) / 2, velocity=velocity)

    def _corrected(self, state: PoseOnlyState, read: Float[Array, " n"], turns: bool) -> PoseOnlyState:
        """The state corrected by a reading; `turns` for a vehicle, whose last three outputs are angles."""
        dt, pole = self.sampling_time, self._pole()
        error = read - state.position
        if turns:
            error = error - 2 * jnp.pi * jnp.round(error / (2 * jnp.pi)) * jnp.asarray([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
        if self.order == 2:
            return state._replace(
                position=state.position + (1 - pole**2) * error, velocity=state.velocity + (1 - pole) ** 2 / dt * error
            )
        return state._replace(
            position=state.position + (1 - pole**3) * error,
            velocity=state.velocity + 1.5 * (1 - pole) ** 2 * (1 + pole) / dt * error,
            acceleration=state.acceleration + (1 - pole) ** 3 / dt**2 * error,
        )

    def _pole(self) -> Float[Array, "..."]:
        """Poles in the z-plane, exp(-w T)."""
        return jnp.exp(-self.bandwidth * self.sampling_time)


def pose_only(noise=0.0, bandwidth=20.0, order: int = 3, sampling_time: float = 1e-3) -> PoseOnly:
    """The pose with white noise at every control step; velocities from an observer. For the sampled loop.

    Args:
        noise: standard deviation of the pose, m and rad; one number or one per output.
        bandwidth: poles of the observer, rad/s; one number or one per output. Faster follows better and is noisier.
        order: 2 for position and velocity (high-gain observer), 3 for the acceleration as well (extended observer).
        sampling_time: that of the loop, s; a scenario sets it.
    """
    return PoseOnly(noise=noise, bandwidth=bandwidth, sampling_time=sampling_time, order=order)
