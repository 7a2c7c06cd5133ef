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
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]
Phasor = Float[Array, "2 n"]  # real and imaginary part

# Largest inertia over that of the nominal model, and the reciprocal of the smallest.
_HEAVIEST = 2.5
_UNKNOWN = 1e3  # standard error where nothing is known
_NOTHING = 1e-9  # square of a response that is too small to be judged, in m^2/s^2, rad^2/s^2


class InertiaState(NamedTuple):
    """What is known of the inertia, as sums over the time of probing."""

    angle: PerAxis  # of the oscillation, rad
    time: PerAxis  # of probing, s
    response: Phasor  # rate besides that of the target, at the probing frequency, m, rad
    applied: Phasor  # acceleration that the nominal model would have, m/s, rad/s
    recent_response: Phasor  # means over the last window, m/s, rad/s
    recent_applied: Phasor  # m/s^2, rad/s^2
    noise: PerAxis  # squared difference between the two, m^2/s^3, rad^2/s^3


class InertiaIdentification(eqx.Module):
    """h of each axis in h v_dot = F + G u + ..., F and G those of the nominal model; 1 where that model is right.

    The target moves by a_p / w_p^2 sin(w_p t) besides. The share sqrt(1 - t_p / `duration`) of it is used, t_p the
    time of probing weighted by the square of that share and forgotten within `horizon`, so that after some minutes
    little probing remains. With V and N the rate v and the
    acceleration n = F + G u + ... of the nominal model, both besides those of the reference and demodulated at w_p,

        h = Re(N / (j w_p V)).

    A drag that the model does not have is in the imaginary part. The standard error s of h comes from what is left of
    N over windows of `window`. Used is 1 + (h - 1) p^2 / (p^2 + s^2), with the deviation p that is plausible before
    anything is known. Axes without an amplitude have h = 1.

    Raises:
        BadInput: a number that is negative, or not positive where it must be.
    """

    amplitude: Float[Param, " n"] = param("m/s^2, rad/s^2", "acceleration of the probing oscillation", symbol="a_p")
    frequency: Float[Param, " n"] = param("rad/s", "of the probing oscillation", symbol="w_p")
    duration: Float[Param, ""] = param("s", "of probing, after which it ends", default=60.0)
    horizon: Float[Param, ""] = param("s", "over which what was found is forgotten", symbol="tau_p", default=1800.0)
    window: Float[Param, ""] = param("s", "over which noise is judged", default=10.0)
    plausible: Float[Param, ""] = param("", "standard deviation of h before anything is known", symbol="p", default=0.5)
    known: tuple[PerAxis, PerAxis] | None = None  # h that is used and s at the start

    def __check_init__(self):
        checks.not_negative("probing", self.amplitude, "m/s^2, rad/s^2")
        for name in ("frequency", "duration", "horizon", "window", "plausible"):
            checks.positive(name, getattr(self, name))

    def check_fit(self, axes: int) -> None:
        """Check that this identification fits a plant.

        Raises:
            BadInput: probing or knowledge for another number of axes.
        """
        checks.length("probing", self.amplitude, axes, "axes")
        for known in self.known or ():
            checks.length("knowledge", known, axes, "axes")

    def init(self, axes: int) -> InertiaState:
        """State before the first step: nothing known, or what is known and no more probing."""
        none, nothing = jnp.zeros((2, axes)), jnp.zeros(axes)
        fresh = InertiaState(nothing, nothing, none, none, none, none, nothing)
        if self.known is None:
            return fresh
        used, error = self.known
        # A response of the expected size, and the applied acceleration and noise that give h and s with it.
        motion = self.amplitude * self.duration / 2
        ratio = 1 + (used - 1) * (1 + (error / self.plausible) ** 2)
        square = jnp.maximum(error**2 - (self.window / self.duration) ** 2, 0.0)
        return fresh._replace(
            time=jnp.broadcast_to(self.duration, (axes,)),
            response=jnp.stack([nothing, -motion / self.frequency]),
            applied=jnp.stack([ratio * motion, nothing]),
            noise=square * (motion**2 + _NOTHING) / self.window,
        )

    def ratio(self, state: InertiaState) -> PerAxis:
        """h as used."""
        real, _ = self._transfer(state)
        prior = self.plausible**2
        used = 1 + (real - 1) * prior / (prior + self.error(state) ** 2)
        return jnp.where(self.amplitude > 0, jnp.clip(used, 1 / _HEAVIEST, _HEAVIEST), 1.0)

    def error(self, state: InertiaState) -> PerAxis:
        """Standard error s of h; large without probing, and before a window has passed, when noise is not known."""
        size = (state.response**2).sum(0) * self.frequency**2 + _NOTHING
        unseen = self.window / jnp.maximum(state.time, self.window / _UNKNOWN)
        found = jnp.sqrt(self.window * state.noise / size + unseen**2)
        return jnp.where(self.amplitude > 0, found, _UNKNOWN)

    def motion(self, state: InertiaState) -> tuple[PerAxis, PerAxis, PerAxis]:
        """Displacement (m, rad), rate and acceleration of the target besides those of the reference."""
        size = self._share(state) * self.amplitude
        sine, cosine = jnp.sin(state.angle), jnp.cos(state.angle)
        return size / self.frequency**2 * sine, size / self.frequency * cosine, -size * sine

    def advance(self, state: InertiaState, rate: PerAxis, nominal: PerAxis, free, dt) -> InertiaState:
        """State one sampling time later.

        Args:
            state: now.
            rate: of the plant besides that of the reference, m/s and rad/s.
            nominal: acceleration until the next step that the nominal model and the memory expect of the applied
                input, besides that of the reference, m/s^2 and rad/s^2.
            free: 1, or 0 while limits bind and nothing is learnt.
            dt: sampling time, s.
        """
        share, span = self._share(state), free * dt
        kept = 1 - span / self.horizon
        response = _demodulated(rate, state.angle)
        applied = _demodulated(nominal, state.angle + self.frequency * dt / 2)
        real, imaginary = self._transfer(state)
        motion = self.frequency[None, :] * _turned(state.recent_response)
        left = state.recent_applied - real[None, :] * motion - imaginary[None, :] * _turned(motion)
        recent = lambda mean, value: mean + span / self.window * (value - mean)
        return InertiaState(
            angle=jnp.mod(state.angle + self.frequency * dt, 2 * jnp.pi),
            time=kept * state.time + span * share**2,
            response=kept * state.response + span * share[None, :] * response,
            applied=kept * state.applied + span * share[None, :] * applied,
            recent_response=recent(state.recent_response, response),
            recent_applied=recent(state.recent_applied, applied),
            noise=kept * state.noise + span * share**2 * (left**2).sum(0),
        )

    def _share(self, state: InertiaState) -> PerAxis:
        left = 1 - state.time / self.duration
        # The root only of what is positive: at zero it has no slope.
        return jnp.where(left > 0, jnp.sqrt(jnp.where(left > 0, left, 1.0)), 0.0)

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
