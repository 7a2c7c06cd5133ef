"""Whether a memory helps: what the modelling error of the observer says about it, per axis.

The observer is linear. With the share g of a memory W^T phi its modelling error is eps = eps_0 - g eps_m, where eps_m
is W^T times the modelling error of phi behind the same observer, and eps_0 that without a memory. The g of least
squares is sum(eps_0 eps_m) / sum(eps_m^2). It is 1 for a memory that explains what it can, since eps is then orthogonal
to eps_m, below 1/2 for one that is worse than none, and other than 1 where the vehicle has changed. Waves and noise
enter eps_0, are not correlated with the reference, and only widen its standard error.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.linear_algebra import safe_sqrt

PerAxis = Float[Array, " n"]

# Modelling errors further apart than this count as independent, s.
_CORRELATED = 1.0
_NOTHING = 1e-12  # m^2/s, rad^2/s: a memory that explains less is not judged


class Evidence(NamedTuple):
    """Sums over time that forget exponentially."""

    time: Float[Array, ""]  # s
    alone: PerAxis  # of eps_0^2, m^2/s, rad^2/s
    shared: PerAxis  # of eps_0 eps_m
    explained: PerAxis  # of eps_m^2


def none(axes: int) -> Evidence:
    """Before the first step."""
    zero = jnp.zeros(axes)
    return Evidence(jnp.zeros(()), zero, zero, zero)


def gathered(past: Evidence, alone: PerAxis, explained: PerAxis, span, judging_time) -> Evidence:
    """Evidence with that of one more step.

    Args:
        past: until now.
        alone: eps_0, m/s and rad/s.
        explained: eps_m, m/s and rad/s.
        span: of the step, s; 0 for a step that does not count.
        judging_time: over which evidence is forgotten, s.
    """
    forgetting = 1 - span / judging_time
    added = Evidence(jnp.ones(()), alone**2, alone * explained, explained**2)
    return Evidence(*(forgetting * old + span * new for old, new in zip(past, added, strict=True)))


def best_share(evidence: Evidence) -> tuple[PerAxis, PerAxis]:
    """The share of the memory that leaves the least modelling error, and twice its standard error."""
    judged = evidence.explained > _NOTHING
    size = jnp.where(judged, evidence.explained, 1.0)
    residual = evidence.alone * evidence.explained - evidence.shared**2
    spread = 2 * safe_sqrt(residual) * jnp.sqrt(_CORRELATED / jnp.maximum(evidence.time, _CORRELATED)) / size
    return jnp.where(judged, evidence.shared / size, 1.0), jnp.where(judged, spread, 1.0)


def trust(evidence: Evidence) -> PerAxis:
    """Share of the memory that is used, 0 to 1: 1 unless less of it is better beyond the standard error."""
    share, spread = best_share(evidence)
    return jnp.clip(share + spread, 0.0, 1.0)


def wrong(evidence: Evidence) -> Float[Array, ""]:
    """How wrong the memory is, 0 to 1: by how far the best share of any axis differs from 1 beyond its error."""
    share, spread = best_share(evidence)
    return jnp.clip(jnp.abs(share - 1) - spread, 0.0, 1.0).max()
