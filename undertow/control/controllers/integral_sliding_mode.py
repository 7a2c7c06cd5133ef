"""Integral sliding mode: the nominal closed loop from the first instant, whatever the load."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import LoopTransfer, axes_of, best_frequency, scalar_if_uniform
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param
from undertow.core.signals import Signal

PerAxis = Float[Array, " n"]

_SHARE = 0.5  # of the authority of the actuators, for the load
_LAYER_RATE = 0.3  # inverse time constant of the layer over the frequency of the nominal loop
_UNLIMITED = 10.0  # m/s^2, rad/s^2


class SlidingState(NamedTuple):
    """State of the law."""

    integral: PerAxis  # of k_1 e + k_2 e_dot and what limits took away, less e_dot at the start, m/s, rad/s
    begun: Float[Array, ""]  # 0 before the first measurement, then 1


class IntegralSlidingMode(AbstractAccelerationLaw):
    """a = a_d + k_1 e + k_2 e_dot + M sat(s / phi), s = e_dot - e_dot(0) + integral of (k_1 e + k_2 e_dot).

    The surface is the nominal closed loop itself, and s is zero at the start: there is no reaching phase. A load
    smaller than M keeps |s| <= phi, and e follows the nominal response with an error that s filtered by the nominal
    loop makes. Inside the layer the law is a PID with a real pole at M / phi beside the two of the nominal loop. What
    limits take away counts as nominal, so that s does not wind up.

    Raises:
        BadInput: a number that is not positive.
    """

    model: Model
    actuation: Actuation
    frequency: Float[Param, "..."] = param(
        "rad/s", "natural frequency of the nominal loop", symbol="w", range=(0.1, 30.0)
    )
    damping: Float[Param, "..."] = param("", "damping ratio of the nominal loop", symbol="zeta", range=(0.3, 3.0))
    amplitude: Float[Param, "..."] = param("m/s^2, rad/s^2", "largest load", symbol="M", range=(0.05, 100.0))
    layer: Float[Param, "..."] = param("m/s, rad/s", "boundary layer of s", symbol="phi", range=(1e-3, 30.0))

    def __check_init__(self):
        for name in ("frequency", "damping", "amplitude", "layer"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
            checks.positive(name, getattr(self, name))

    def init_law(self, y: Measurement, r: Target) -> SlidingState:
        return SlidingState(jnp.zeros_like(y.position), jnp.zeros(()))

    def acceleration(self, state: SlidingState, y: Measurement, tracking_error: TrackingError):
        surface, switching = self._surface(state, tracking_error)
        demanded = tracking_error.acceleration + self._nominal(tracking_error) + switching
        return demanded, {"estimate": -switching, "surface": surface}

    def update(
        self, state: SlidingState, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> SlidingState:
        integral = jnp.where(state.begun > 0, state.integral, -tracking_error.rate)
        return SlidingState(integral + dt * (self._nominal(tracking_error) + actuation.missing), jnp.ones(()))

    def signals(self):
        return ESTIMATE | {"surface": Signal(("axis",), "[axis]/s", "distance s from the surface")} | ATTAINED_SHARE

    def _nominal(self, tracking_error: TrackingError) -> PerAxis:
        return self.frequency**2 * tracking_error.error + 2 * self.damping * self.frequency * tracking_error.rate

    def _surface(self, state: SlidingState, tracking_error: TrackingError) -> tuple[PerAxis, PerAxis]:
        """s, and M sat(s / phi)."""
        surface = jnp.where(state.begun > 0, tracking_error.rate + state.integral, 0.0)
        return surface, self.amplitude * jnp.clip(surface / self.layer, -1, 1)


@flat_options()
def integral_sliding_mode(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    frequency=None,
    damping=1.0,
    amplitude=None,
    layer=None,
    actuation: ActuationOptions = ActuationOptions(),
) -> IntegralSlidingMode:
    """Integral sliding mode: Utkin and Shi (1996); boundary layer by Slotine and Li (1991), ch. 7. Body axes.

    Args:
        model: nominal model, from `plant.model()`.
        frequency: natural frequency w of the nominal loop, rad/s; one number or one per axis. None: the one of least
            predicted cost that keeps the margins of `bandwidths.py` inside the layer.
        damping: its damping ratio.
        amplitude: M, largest load that is rejected, m/s^2 and rad/s^2. None: half of the authority of the actuators,
            10 where they have no limit.
        layer: phi, boundary layer of s, m/s and rad/s. None: M / (0.3 w), a third as fast as the nominal loop.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    axes = axes_of(model, conditions)
    if frequency is None:
        frequency = scalar_if_uniform([best_frequency(axis, _inside_the_layer) for axis in axes])
    if amplitude is None:
        amplitude = scalar_if_uniform(
            [_SHARE * axis.authority if np.isfinite(axis.authority) else _UNLIMITED for axis in axes]
        )
    for name, value in (("frequency", frequency), ("amplitude", amplitude)):
        checks.per_axis(name, value, len(axes))
        checks.positive(name, value)
    if layer is None:
        layer = jnp.asarray(amplitude, dtype=float) / (_LAYER_RATE * jnp.asarray(frequency, dtype=float))
    return IntegralSlidingMode(
        model=model,
        actuation=actuation_for(conditions.sampling_time, frequency, actuation),
        frequency=frequency,
        damping=damping,
        amplitude=amplitude,
        layer=layer,
    )


def _inside_the_layer(w, s) -> LoopTransfer:
    """The law with the default damping and layer: (p + c) (p + w)^2 with c = 0.3 w."""
    c = _LAYER_RATE * w
    return LoopTransfer(w**2 + 2 * w * c + c * w**2 / s, 2 * w + c + 0 * s)
