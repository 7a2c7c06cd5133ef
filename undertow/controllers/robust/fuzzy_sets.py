"""How wide fuzzy sets must be, so that wherever noise drives their weights it does not matter: section 3.8."""

import jax
import jax.numpy as jnp

from undertow.estimation.tsk import FuzzySystem

# Share of the estimator's own damping that weights anywhere in their box may add to it.
_ADDED = 0.1
_LEAST = 1.0  # m/s, rad/s


def widened(fuzzy: FuzzySystem, bandwidth, damping, bound) -> FuzzySystem:
    """Sets with their centres and widths scaled by the smallest factor that is wide enough, one at least.

    Drift adds c <= theta_max sum |xi'(0)| to 2 zeta w_o, and xi' falls with the width. The sets are then so wide that
    the basis hardly moves: what is left is one integrator per axis, which is all that the paper's law is in effect.

    Args:
        fuzzy: with sets out to 1.
        bandwidth: w_o, rad/s.
        damping: zeta.
        bound: theta_max, m/s^2 and rad/s^2; without a finite one nothing is wide enough, and the sets stay.
    """
    slope = jnp.abs(jax.jacfwd(lambda x: fuzzy.basis(x[None, None])[0])(jnp.zeros(()))).sum()
    reach = jnp.asarray(bound, dtype=float) * slope / (_ADDED * 2 * jnp.asarray(damping) * jnp.asarray(bandwidth))
    factor = jnp.maximum(_LEAST, jnp.max(jnp.where(jnp.isfinite(reach), reach, _LEAST)))
    return FuzzySystem(factor * fuzzy.centres, factor * fuzzy.widths, evenly_spaced=fuzzy.evenly_spaced)
