"""The identification model and the composite adaptive law in discrete time: stable at any sampling time."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.estimation.fuzzy_system import FuzzySystem
from undertow.core import checks
from undertow.core.arrays import as_array, library_of
from undertow.core.kept_programs import kept_program
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]

_EVEN = 1e-12  # squared size below which a basis counts as equal for all rules


class EstimatorState(NamedTuple):
    """Estimated rates, and adapted weights."""

    rates: PerAxis  # m/s, rad/s
    weights: Float[Array, "n rules"]  # theta, m/s^2, rad/s^2


class UncertaintyEstimate(NamedTuple):
    """d_hat, and the error and basis it comes from."""

    error: PerAxis  # eps, m/s, rad/s
    basis: Float[Array, "n rules"]  # xi
    uncertainty: PerAxis  # d_hat, m/s^2, rad/s^2


class Estimator(eqx.Module):
    """Eqs. (31), (32), (42), (44) with poles at exp(p T), p^2 + 2 zeta w_o p + w_o^2 = 0. Section X7 of the theory.

    Per axis, with alpha = 2 zeta w_o and gamma gamma_eps |xi|^2 = w_o^2 this is the paper's pair of equations, sampled
    exactly as long as the basis does not change. The step of the weights changes d_hat by a given amount for any
    |xi|^2, and the weights are kept in their box.

    The part of the weights that is orthogonal to the basis and to (1, ..., 1) decays by leakage. By Eq. (44) it could
    only grow, with the square of the modelling error (section 3.8 of the theory). It does not affect the estimate, and
    a constant load needs equal weights, so the leakage costs no accuracy; it adds -leakage |that part|^2 / gamma to the
    rate of the Lyapunov function.

    Raises:
        BadInput: bandwidth, damping or bound not positive, leakage negative.
    """

    fuzzy: FuzzySystem
    bandwidth: Float[Param, "..."] = param("rad/s", "natural frequency of the estimator", symbol="w_o")
    damping: Float[Param, "..."] = param("", "damping ratio of the estimator", symbol="zeta", default=1.0)
    bound: Float[Param, "..."] = param("m/s^2, rad/s^2", "largest size of a weight", symbol="theta_max", default=50.0)
    leakage: Float[Param, "..."] = param(
        "1/s", "decay rate of differences between weights", symbol="kappa", default=0.01
    )

    def __check_init__(self):
        checks.positive("bandwidth", self.bandwidth, "rad/s")
        checks.positive("damping", self.damping)
        checks.positive("bound", self.bound, finite=False)
        checks.not_negative("leakage", self.leakage, "1/s")

    def init(self, rates: PerAxis) -> EstimatorState:
        """State with zero weights."""
        return EstimatorState(rates, jnp.zeros((rates.shape[0], self.fuzzy.rules)))

    def estimate(self, state: EstimatorState, rates: PerAxis) -> UncertaintyEstimate:
        """Modelling error and estimate at measured rates."""
        error = state.rates - rates
        basis = self.fuzzy.basis(error[:, None])
        return UncertaintyEstimate(error, basis, self.fuzzy.output(state.weights, basis))

    @eqx.filter_jit
    def gains(self, dt: Float[Array, ""]) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
        """Correction of the rates (1) and of d_hat (1/s) per modelling error."""
        decay = jnp.exp(-self.damping * self.bandwidth * dt)
        pole_sum = 2 * decay * _cosine_of_root((self.bandwidth * dt) ** 2 * (1 - self.damping**2))  # sum of the poles
        return 2 - pole_sum, (1 + decay**2 - pole_sum) / dt

    def advance(
        self, state: EstimatorState, observed: UncertaintyEstimate, modelled: PerAxis, tracking: PerAxis, dt
    ) -> EstimatorState:
        """State one sampling time later.

        Args:
            state: now.
            observed: `estimate` of now.
            modelled: F + G u of the applied input, m/s^2 and rad/s^2.
            tracking: mu s, the share of the filtered tracking error, m/s and rad/s; zero for a pure observer.
            dt: sampling time, s.
        """
        of_rates, of_estimate = self.gains(dt)
        correction = of_estimate * (observed.error + tracking)
        weights = state.weights - (correction / (observed.basis**2).sum(-1))[:, None] * observed.basis
        leaked = -jnp.expm1(-jnp.broadcast_to(self.leakage, correction.shape) * dt)[:, None]
        weights = weights - leaked * _unseen(weights, observed.basis)
        rates = state.rates + dt * (modelled + observed.uncertainty) - of_rates * observed.error
        return EstimatorState(rates, self._in_box(weights))

    def lowered(self, state: EstimatorState, amount: PerAxis) -> EstimatorState:
        """State with a lower d_hat, within the box, because something else gives that amount now, m/s^2 and rad/s^2.

        The basis sums to one, so that an equal change of all weights changes d_hat by as much.
        """
        return state._replace(weights=self._in_box(state.weights - amount[:, None]))

    def _in_box(self, weights: Float[Array, "n rules"]) -> Float[Array, "n rules"]:
        box = jnp.broadcast_to(self.bound, weights.shape[:1])[:, None]
        return jnp.clip(weights, -box, box)


def _unseen(weights: Float[Array, "n rules"], basis: Float[Array, "n rules"]) -> Float[Array, "n rules"]:
    """The part of the weights that is orthogonal to the basis and to (1, ..., 1)."""
    centred, direction = (rows - rows.mean(-1, keepdims=True) for rows in (weights, basis))
    size = (direction**2).sum(-1, keepdims=True)
    along = (centred * direction).sum(-1, keepdims=True) / jnp.where(size > _EVEN, size, 1.0)
    return centred - along * direction


def _cosine_of_root(x: Float[Array, "..."]) -> Float[Array, "..."]:
    """cos(sqrt(x)), which is smooth through 0 and cosh(sqrt(-x)) beyond."""
    small = jnp.abs(x) < 1e-6
    root = jnp.sqrt(jnp.where(small, 1.0, jnp.abs(x)))
    return jnp.where(small, 1 - x / 2 + x**2 / 24, jnp.where(x > 0, jnp.cos(root), jnp.cosh(root)))


# Share of the estimator's own damping that weights within their box may add to it.
_ADDED = 0.1
_LEAST = 1.0  # m/s, rad/s


def widened(fuzzy: FuzzySystem, bandwidth, damping, bound) -> FuzzySystem:
    """Sets with centres and widths scaled by the smallest sufficient factor, at least one.

    Drift adds c <= theta_max sum |xi'(0)| to 2 zeta w_o, and xi' falls with the width. The sets are then so wide that
    the basis is nearly constant, and the estimator is one integrator per axis, as the paper's law is in effect.

    Args:
        fuzzy: system with sets from -1 to 1.
        bandwidth: w_o, rad/s.
        damping: zeta.
        bound: theta_max, m/s^2 and rad/s^2; without a finite one the sets are unchanged.
    """
    # Operation by operation, and not compiled, so that one value and many traced ones are rounded alike.
    settings = (bandwidth, damping, bound, _slope(fuzzy))
    library = library_of(*settings)
    bandwidth, damping, bound, slope = (library.asarray(value, dtype=float) for value in settings)
    with np.errstate(divide="ignore", invalid="ignore"):  # of values that the estimator refuses
        reach = bound * (slope / (_ADDED * 2 * damping * bandwidth))
    factor = library.maximum(_LEAST, library.where(library.isfinite(reach), reach, _LEAST)).max()
    centres, widths = (as_array(library.multiply(factor, values)) for values in (fuzzy.centres, fuzzy.widths))
    return FuzzySystem(centres, widths, evenly_spaced=fuzzy.evenly_spaced)


@kept_program
def _slope(fuzzy: FuzzySystem) -> Float[Array, ""]:
    """Sum |xi'(0)|."""
    return jnp.abs(jax.jacfwd(lambda x: fuzzy.basis(x[None, None])[0])(jnp.zeros(()))).sum()
