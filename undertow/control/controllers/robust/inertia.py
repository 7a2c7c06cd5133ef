"""Inertia of each axis, identified from the response to a small probing oscillation.

The nominal inertia scales every correction of the law. Where the vehicle's is twice as large, feedback and observer
have half their effect. What a reference does not excite, like roll and pitch of a survey, no regression finds, and
waves do not help: in closed loop the forces answer them in a way that fits any inertia. A probing oscillation does.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.numerics.linear_algebra import safe_sqrt
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]
Phasor = Float[Array, "2 n"]  # real and imaginary part

# Largest inertia over that of the nominal model, and the reciprocal of the smallest.
_HEAVIEST = 2.5
_UNKNOWN = 1e3  # standard error where nothing is known
_SUDDEN = 3.0  # what is left is more than this times its rms where a load has just changed
_NOTHING = 1e-9  # square of a response that is too small to be judged, in m^2/s^2, rad^2/s^2


class InertiaState(NamedTuple):
    """What is known of the inertia, as sums over the time of probing."""

    angle: PerAxis  # of the oscillation, rad
    time: PerAxis  # of probing, weighted by the square of its share, s
    counted: PerAxis  # part of it that counts, s
    response: Phasor  # rate besides that of the target, at the probing frequency, m, rad
    applied: Phasor  # acceleration that the nominal model would have, m/s, rad/s
    since: Float[Array, ""]  # time since the last window ended, s
    window_response: Phasor  # sums over this time, m, rad
    window_applied: Phasor  # m/s, rad/s
    window_size: PerAxis  # integral of the amplitude over this time, m/s, rad/s
    noise: PerAxis  # squared difference between the two, m^2/s^3, rad^2/s^3
    square: PerAxis  # mean square of the error from the target over the last window, m^2, rad^2


class InertiaIdentification(eqx.Module):
    """h of each axis in h v_dot = F + G u + ..., F and G those of the nominal model; 1 where that model is right.

    The target moves by a / w_p^2 sin(w_p t) besides, with a = min(a_p, rho w_p^2 e) sqrt(1 - t_p / `duration`). The rms
    error e over the last `window` limits it: where errors are small, probing must add little to them, and a better
    inertia would gain little. t_p is the time of probing weighted by 1 - t_p / `duration` and forgotten within
    `horizon`, so that after some minutes little probing remains. With V and N the rate v and the acceleration
    n = F + G u + ... of the nominal model, both besides those of the reference and demodulated at w_p,

        h = Re(N / (j w_p V)).

    A drag that the model does not have is in the imaginary part. V and N are sums over windows of `window`, each with
    the weight m / (m + l^2): l is what is left of its N, and m nine times the mean l^2 plus what the oscillation itself
    would give. A load that changes at once, which looks like an inertia, then counts little. The standard error s of h
    comes from the mean l^2, half of which is in the real part. The result is h_0 + (h - h_0) p^2 / (p^2 + s^2), with
    what is expected before anything is found, h_0, and its standard deviation p. Axes without an amplitude have h_0.

    Corrections are scaled by max(h, 1). A vehicle with less inertia than its model has a faster loop than was designed,
    which reduces errors and margins as it does without identification; slowing it down would make errors larger.

    Raises:
        BadInput: a number that is negative, or not positive where it must be.
    """

    amplitude: Float[Param, " n"] = param("m/s^2, rad/s^2", "acceleration of the probing oscillation", symbol="a_p")
    frequency: Float[Param, " n"] = param("rad/s", "of the probing oscillation", symbol="w_p")
    duration: Float[Param, ""] = param("s", "of probing, after which it ends", default=60.0)
    horizon: Float[Param, ""] = param("s", "over which what was found is forgotten", symbol="tau_p", default=1800.0)
    window: Float[Param, ""] = param("s", "over which noise is judged", default=10.0)
    plausible: Float[Param, ""] = param("", "standard deviation of h before anything is known", symbol="p", default=0.5)
    error_share: Float[Param, ""] = param(
        "", "displacement of probing, at most, over the rms error", symbol="rho", default=0.3
    )
    expected: PerAxis | None = None  # h_0; None: 1

    def __check_init__(self):
        checks.not_negative("probing", self.amplitude, "m/s^2, rad/s^2")
        for name in ("frequency", "duration", "horizon", "window", "plausible", "error_share"):
            checks.positive(name, getattr(self, name))

    def check_fit(self, axes: int) -> None:
        """Check that this identification fits a plant.

        Raises:
            BadInput: probing or knowledge for another number of axes.
        """
        checks.length("probing", self.amplitude, axes, "axes")
        if self.expected is not None:
            checks.length("knowledge", self.expected, axes, "axes")

    def init(self, axes: int) -> InertiaState:
        """State before the first step."""
        axis, phasor, zero = jnp.zeros(axes), jnp.zeros((2, axes)), jnp.zeros(())
        return InertiaState(axis, axis, axis, phasor, phasor, zero, phasor, phasor, axis, axis, axis)

    def ratio(self, state: InertiaState) -> PerAxis:
        """h, shrunk towards what is expected by its standard error."""
        real, _ = self._transfer(state)
        prior = self.plausible**2
        expected = 1.0 if self.expected is None else self.expected
        shrunk = expected + (real - expected) * prior / (prior + self.error(state) ** 2)
        return jnp.clip(jnp.where(self.amplitude > 0, shrunk, expected), 1 / _HEAVIEST, _HEAVIEST)

    def used(self, state: InertiaState) -> PerAxis:
        """h by which corrections are scaled, from 1."""
        return jnp.maximum(self.ratio(state), 1.0)

    def error(self, state: InertiaState) -> PerAxis:
        """Standard error s of h; large without probing, and before two windows, when noise is not known."""
        real, _ = self._transfer(state)
        size = (state.response**2).sum(0) * self.frequency**2 + _NOTHING
        unseen = (self.window / jnp.maximum(state.counted, self.window / _UNKNOWN)) ** 4
        impossible = (real - jnp.clip(real, 1 / _HEAVIEST, _HEAVIEST)) ** 2
        deviation = jnp.sqrt(self.window * state.noise / (2 * size) + unseen + impossible)
        return jnp.where(self.amplitude > 0, jnp.minimum(deviation, _UNKNOWN), _UNKNOWN)

    def motion(self, state: InertiaState) -> tuple[PerAxis, PerAxis, PerAxis]:
        """Displacement (m, rad), rate and acceleration of the target besides those of the reference."""
        size, sine, cosine = self._size(state), jnp.sin(state.angle), jnp.cos(state.angle)
        return size / self.frequency**2 * sine, size / self.frequency * cosine, -size * sine

    def advance(self, state: InertiaState, error: PerAxis, rate: PerAxis, nominal: PerAxis, free, dt) -> InertiaState:
        """State one sampling time later.

        Args:
            state: now.
            error: of the plant from the reference, reference less plant, m and rad.
            rate: of the plant besides that of the reference, m/s and rad/s.
            nominal: acceleration until the next step that the nominal model and the memory expect of the applied
                input, besides that of the reference, m/s^2 and rad/s^2.
            free: 1, or 0 while limits bind and nothing is learnt.
            dt: sampling time, s.
        """
        share, span, square = self._share(state), free * dt, (error + self.motion(state)[0]) ** 2
        response = state.window_response + span * _demodulated(rate, state.angle)
        applied = state.window_applied + span * _demodulated(nominal, state.angle + self.frequency * dt / 2)
        # At the end of a window, its weight in what is found.
        real, imaginary = self._transfer(state)
        motion = self.frequency[None, :] * _turned(response)
        residual = ((applied - real[None, :] * motion - imaginary[None, :] * _turned(motion)) ** 2).sum(0) / self.window
        size = state.window_size + span * self._size(state)
        usual = state.noise / jnp.maximum(state.counted, _NOTHING)
        plausible_residual = self.window * _SUDDEN**2 * usual + (size / 2) ** 2 / self.window
        ended = state.since + span >= self.window
        weight = jnp.where(ended, plausible_residual / (plausible_residual + residual + _NOTHING**2), 0.0)
        forgetting, running = 1 - span / self.horizon, jnp.where(ended, 0.0, 1.0)
        return InertiaState(
            angle=jnp.mod(state.angle + self.frequency * dt, 2 * jnp.pi),
            time=forgetting * state.time + span * share**2,
            response=forgetting * state.response + (share * weight)[None, :] * response,
            applied=forgetting * state.applied + (share * weight)[None, :] * applied,
            counted=forgetting * state.counted + share**2 * weight * self.window,
            since=running * (state.since + span),
            window_response=running * response,
            window_applied=running * applied,
            window_size=running * size,
            noise=forgetting * state.noise + share**2 * weight * residual,
            square=state.square + dt / self.window * (square - state.square),
        )

    def _size(self, state: InertiaState) -> PerAxis:
        """a, m/s^2 and rad/s^2."""
        largest = jnp.minimum(self.amplitude, self.error_share * self.frequency**2 * safe_sqrt(state.square))
        return self._share(state) * largest

    def _share(self, state: InertiaState) -> PerAxis:
        return safe_sqrt(1 - state.time / self.duration)

    def _transfer(self, state: InertiaState) -> tuple[PerAxis, PerAxis]:
        """N / (j w_p V), real and imaginary part; 1 where there is no response."""
        motion = self.frequency[None, :] * _turned(state.response)
        size = (motion**2).sum(0) + _NOTHING
        real = (state.applied * motion).sum(0) + _NOTHING
        return real / size, (state.applied * _turned(motion)).sum(0) / size


def _demodulated(value: PerAxis, angle: PerAxis) -> Phasor:
    """value exp(-j angle)."""
    return jnp.stack([value * jnp.cos(angle), -value * jnp.sin(angle)])


def _turned(phasor: Phasor) -> Phasor:
    """j times a phasor."""
    return jnp.stack([-phasor[1], phasor[0]])
