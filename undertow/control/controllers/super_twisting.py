"""Super-twisting sliding-mode control: finite time against a load of bounded rate, by a continuous input."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import LoopTransfer, axes_of, best_frequency, scalar_if_uniform
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.errors import BadInput
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param
from undertow.core.signals import Signal

PerAxis = Float[Array, " n"]

_FIRST, _SECOND = 2.0, 1.1
_SHARE = 0.1  # 1/s, rate of the load over the authority of the actuators
_TINY = 1e-12
_STEEP = 2.0  # gain of the first term inside the layer over the slope of the surface


class SuperTwisting(AbstractAccelerationLaw):
    """a = a_d + l e_dot + k_1 |s|^(1/2) sign(s) + w, w_dot = k_2 sign(s), on the surface s = e_dot + l e.

    k_1 = c_1 L^(1/2) and k_2 = c_2 L with L the bound of the rate of the load. In a layer |s| < phi, where a sampled
    loop with lag cannot follow the root, both terms are linear, and the law is a PID with k_d = l + k_1 / phi^(1/2),
    k_p = l k_1 / phi^(1/2) + k_2 / phi and k_i = l k_2 / phi. Without the layer s and its rate are zero after a finite
    time, and w is then the load.

    The state of the law is w, m/s^2 and rad/s^2.

    Raises:
        BadInput: a number that is not positive, or c_1 and c_2 too small for a load of rate L.
    """

    model: Model
    actuation: Actuation
    slope: Float[Param, "..."] = param("1/s", "rate of decay on the surface", symbol="l", range=(0.1, 30.0))
    rate_bound: Float[Param, "..."] = param(
        "m/s^3, rad/s^3", "bound of the rate of the load", symbol="L", range=(0.01, 100.0)
    )
    layer: Float[Param, "..."] = param("m/s, rad/s", "layer in which the law is linear", symbol="phi", range=(1e-4, 10))
    first: Float[Param, "..."] = param("", "factor of the first gain", symbol="c_1")
    second: Float[Param, "..."] = param("", "factor of the second gain", symbol="c_2")

    def __check_init__(self):
        for name in ("slope", "rate_bound", "layer", "first", "second"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
            checks.positive(name, getattr(self, name))
        enough = lambda first, second: (contraction(first, second) < 1).all()
        if not checks.assumed(enough, self.first, self.second):
            least = float(np.max(least_second(np.asarray(self.first))))
            raise BadInput("second", f"be more than {least:.4g} with this `first`", float(np.min(self.second)))

    def init_law(self, y: Measurement, r: Target) -> PerAxis:
        return jnp.zeros_like(y.position)

    def acceleration(self, state: PerAxis, y: Measurement, tracking_error: TrackingError):
        error, rate, acceleration = tracking_error
        surface = rate + self.slope * error
        root = surface / jnp.sqrt(jnp.maximum(jnp.abs(surface), self.layer))
        demanded = acceleration + self.slope * rate + self.first * jnp.sqrt(self.rate_bound) * root + state
        return demanded, {"estimate": -state, "surface": surface}

    def update(
        self, state: PerAxis, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> PerAxis:
        """w one sampling time later; what limits take away is given back to it, as to the integral of `pid`."""
        surface = tracking_error.rate + self.slope * tracking_error.error
        second = self.second * self.rate_bound
        steepest = self.slope + self.first * jnp.sqrt(self.rate_bound / self.layer)
        back = jnp.minimum(jnp.sqrt(self.slope * second / self.layer / steepest), 1 / dt) * actuation.missing
        return state + dt * (second * surface / jnp.maximum(jnp.abs(surface), self.layer) + back)

    def signals(self):
        return ESTIMATE | {"surface": Signal(("axis",), "[axis]/s", "distance s from the surface")} | ATTAINED_SHARE


def contraction(first, second):
    """Largest ratio of |w - load| at successive crossings of the surface, under a load of rate at most L.

    The worst load slows w by L until s turns, and drives it by L from there to the next crossing: in the plane of s and
    w its path encloses that of any other. Both parts are linear in |s|^(1/2) and w, in a time that runs as the inverse
    of |s|^(1/2). Where the ratio is below 1, s and its rate vanish in finite time; where it is above, this load wins.
    """
    xp = jnp if isinstance(first, jax.Array) or isinstance(second, jax.Array) else np
    first, second = xp.broadcast_arrays(first, second)
    a, slow, fast = first / 2, 2 * xp.maximum(second - 1, _TINY), 2 * (second + 1)
    # Squared cosines of the two angles less 1; at 0 both quotients are 1 / slow^(1/2).
    discriminant = (slow - a**2) / slow
    discriminant = xp.where(abs(discriminant) < _TINY, _TINY, discriminant)
    circular = xp.arccos(xp.sqrt(1 - xp.maximum(discriminant, 0.0)))
    hyperbolic = xp.arccosh(xp.sqrt(1 - xp.minimum(discriminant, 0.0)))
    turn = circular + hyperbolic  # one of them is 0
    left = xp.maximum(fast - a**2, _TINY)
    surface = xp.arccos(-a / xp.sqrt(a**2 + left)) / xp.sqrt(left)
    ratio = xp.sqrt(fast / slow) * xp.exp(-a * (turn / xp.sqrt(abs(discriminant) * slow) + surface))
    ratio = xp.where(a**2 < fast, ratio, 0.0)  # else the surface is reached without a further crossing
    return xp.where(second > 1, ratio, xp.inf)


def least_second(first):
    """c_2 above which every load whose rate is at most L is rejected in finite time."""
    first = np.asarray(first, dtype=float)
    low, high = np.ones_like(first), np.full_like(first, 1e4)
    for _ in range(60):
        middle = (low + high) / 2
        enough = contraction(first, middle) < 1
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return high


@flat_options()
def super_twisting(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    slope=None,
    rate_bound=None,
    layer=None,
    first=_FIRST,
    second=_SECOND,
    actuation: ActuationOptions = ActuationOptions(),
) -> SuperTwisting:
    """Super-twisting control: Levant (1993); gains by Moreno and Osorio (2012). Body axes and quaternions.

    Args:
        model: nominal model, from `plant.model()`.
        slope: l, rate of decay on the surface, 1/s; one number or one per axis. None: the one of least predicted cost
            that keeps the margins of `bandwidths.py` where the law is linear.
        rate_bound: L, largest rate of the load that the model does not know, m/s^3 and rad/s^3; one number or one per
            axis. None: a tenth of the authority of the actuators per second, 1 where they have no limit.
        layer: phi, m/s and rad/s: below it the law is linear. None: that in which the first term has twice the slope.
            A layer of 1e-9 is none.
        first: c_1 of the first gain c_1 L^(1/2); Levant (1998) has 1.5.
        second: c_2 of the second gain c_2 L; Levant (1998) has 1.1.
        reference_frequency: that of the filter of reference jumps, rad/s; None: the slope, 2 at most; 0 for no filter.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    axes = axes_of(model, conditions)
    if slope is None:
        slope = scalar_if_uniform([best_frequency(axis, _inside_the_layer) for axis in axes])
    if rate_bound is None:
        rate_bound = scalar_if_uniform(
            [_SHARE * axis.authority if np.isfinite(axis.authority) else 1.0 for axis in axes]
        )
    for name, value in (("slope", slope), ("rate_bound", rate_bound), ("first", first)):
        checks.per_axis(name, value, len(axes))
        checks.positive(name, value)
    if layer is None:
        steep, bound, factor = (jnp.asarray(value, dtype=float) for value in (slope, rate_bound, first))
        layer = bound * (factor / (_STEEP * steep)) ** 2
    return SuperTwisting(
        model=model,
        actuation=actuation_for(conditions.sampling_time, 2 * jnp.asarray(slope, dtype=float), actuation),
        slope=slope,
        rate_bound=rate_bound,
        layer=layer,
        first=first,
        second=second,
    )


def _inside_the_layer(slope, s) -> LoopTransfer:
    """The law with the default gains where it is linear."""
    steep = _STEEP * slope
    second = _SECOND * (steep / _FIRST) ** 2
    return LoopTransfer(slope * steep + second + slope * second / s, slope + steep + 0 * s)
