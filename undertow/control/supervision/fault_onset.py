"""What the last residuals say of a fault that began some examinations ago: of each thruster and each possible onset."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.linear_algebra import inverse_symmetric, matvec

PerActuator = Float[Array, " m"]
PerAxis = Float[Array, " n"]

# Examinations back to which an onset is looked for, and between the samples of the wide second difference.
ONSETS, WIDE = 10, 5
# First values of the covariances, and their values that are always there, in squares of the unit.
_START, _FLOOR = 1.0, 0.02
_WIDE_START, _WIDE_FLOOR = 25.0, 0.25
# Vectors that a first value counts for, and largest squared size of one, relative to its mean, that is learned.
_FIRST, _CLIP = 4.0, 9.0


class Weighed(NamedTuple):
    """A vector e and the directions E_i of the thrusters, weighed by the inverse covariance P."""

    products: Float[Array, "m m"]  # E_i . P E_j
    size: PerActuator  # E_i . P E_i
    along: PerActuator  # E_i . P e
    total: Float[Array, ""]  # e . P e


class OnsetState(NamedTuple):
    """What is kept of the last examinations, the latest first, with k possible onsets; residuals in units."""

    residuals: Float[Array, "r n"]
    forces: Float[Array, "k c m"]  # nominal forces behind two low-passes and, where c is 3, behind one and none, N
    along: Float[Array, "k m"]  # sums of s . P e since each possible onset, with s what the fault adds to e
    size: Float[Array, "k m"]  # sums of s . P s
    total: Float[Array, " k"]  # sums of e . P e
    covariance: Float[Array, "n n"]  # of e without faults


class Wide(NamedTuple):
    """The second difference of residuals `WIDE` examinations apart: a change of force between them is whole in it."""

    weighed: Weighed
    changes: PerActuator  # the same difference of the nominal forces, N


def onset_state(
    axes: int, actuators: int, onsets: int = ONSETS, residuals: int = ONSETS, columns: int = 3
) -> OnsetState:
    """State before the first examination.

    Args:
        axes, actuators: n and m.
        onsets: k.
        residuals: r; `examine` needs two, `wide_difference` needs `ONSETS`.
        columns: c.
    """
    return OnsetState(
        residuals=jnp.zeros((residuals, axes)),
        forces=jnp.zeros((onsets, columns, actuators)),
        along=jnp.zeros((onsets, actuators)),
        size=jnp.zeros((onsets, actuators)),
        total=jnp.zeros(onsets),
        covariance=_START * jnp.eye(axes),
    )


def wide_covariance(axes: int) -> Float[Array, "n n"]:
    """Covariance of the wide difference before the first examination."""
    return _WIDE_START * jnp.eye(axes)


def weighed(effect: Float[Array, "n m"], covariance: Float[Array, "n n"], vector: PerAxis) -> Weighed:
    """A vector and directions, weighed by the inverse of a covariance."""
    inverse = inverse_symmetric(covariance)
    weighted_vector = matvec(inverse, vector)
    columns = effect.T
    weighted_columns = (columns[:, None, :] * inverse[None, :, :]).sum(-1)
    products = (weighted_columns[:, None, :] * columns[None, :, :]).sum(-1)
    squares = (weighted_columns * columns).sum(-1)
    size = jnp.where(squares > 0, squares, 1.0)
    return Weighed(products, size, matvec(columns, weighted_vector), (vector * weighted_vector).sum())


def transients(bandwidth, decay, elapsed, onsets: int = ONSETS) -> Float[Array, "k+1 3"]:
    """What remains of the forces of an onset 0, 1, ... examinations later behind two low-passes, per force.

    The thrust of a thruster that stops decays exponentially; that of the onset is in the low-passes as well.

    Args:
        bandwidth: w of each low-pass, rad/s.
        decay: time constant of the thrust, s.
        elapsed: time between examinations, s.
        onsets: how many are possible.

    Returns:
        One row per examination, one column for the force behind two, one and no low-pass.
    """
    t = elapsed * jnp.arange(onsets + 1, dtype=jnp.asarray(elapsed).dtype)
    slow = jnp.exp(-bandwidth * t)
    rate = 1 / decay
    rate = jnp.where(jnp.abs(bandwidth - rate) < 0.01 * bandwidth, 0.99 * bandwidth, rate)  # the limit of equal ones
    difference = bandwidth - rate
    stopped = (bandwidth / difference) ** 2 * (jnp.exp(-rate * t) - slow * (1 + difference * t))
    return jnp.stack([slow, slow * bandwidth * t, stopped], axis=1)


def examine(
    past: OnsetState,
    residual: PerAxis,
    forces: Float[Array, "c m"],
    effect: Float[Array, "n m"],
    error_share: PerActuator,
    remains: Float[Array, "k+1 c"],
    learned: Float[Array, ""],
) -> tuple[OnsetState, Float[Array, "k m"]]:
    """State with one more residual, and the force that a thruster that stopped at each onset is missing by now, N.

    The innovation e is the second difference of the residual: loads, waves and errors of the model change slowly and
    almost disappear in it. A thruster that stopped l examinations ago is missing its nominal force of now but for
    what `remains`, and adds the second difference of that to e.

    Args:
        past: state until now.
        residual: of now, in units.
        forces: nominal ones of now, as in the state, N.
        effect: acceleration per force, in units.
        error_share: share of a change of the nominal force of each thruster that the model may miss.
        remains: of each column of the forces, as by `transients`.
        learned: part of the covariance that is replaced by this innovation.
    """
    before, unit = past.forces[:, 0], jnp.eye(len(residual))
    innovation = residual - 2 * past.residuals[0] + past.residuals[1]
    change = forces[0] - 2 * before[0] + before[1]
    covariance = past.covariance + _FLOOR * unit + _unknown(effect, error_share * change)
    weighed_innovation = weighed(effect, covariance, innovation)
    # Second difference of the missing force, which is zero at the onset and before.
    bent = jnp.concatenate([remains[1:2], remains[2:] - 2 * remains[1:-1] + remains[:-2]])
    first = (jnp.arange(len(past.total)) == 0)[:, None]
    added = jnp.where(first, forces[:1], change[None]) - (bent[:, :, None] * past.forces).sum(1)
    missing = forces[:1] - (remains[1:, :, None] * past.forces).sum(1)
    after = OnsetState(
        residuals=jnp.concatenate([residual[None], past.residuals[:-1]]),
        forces=jnp.concatenate([forces[None], past.forces[:-1]]),
        along=_later(past.along) - added * weighed_innovation.along[None],
        size=_later(past.size) + added * added * weighed_innovation.size[None],
        total=_later(past.total) + weighed_innovation.total,
        covariance=_learned(past.covariance, learned, innovation, weighed_innovation.total),
    )
    return after, missing


def wide_difference(
    past: OnsetState,
    covariance: Float[Array, "n n"],
    residual: PerAxis,
    forces: PerActuator,
    effect: Float[Array, "n m"],
    error_share: PerActuator,
    learned: Float[Array, ""],
) -> tuple[Wide, Float[Array, "n n"]]:
    """The wide difference with one more residual, and its covariance one examination later.

    Args:
        past: state until now, with all residuals.
        covariance: of the wide difference without faults, until now.
        residual: of now, in units.
        forces: nominal ones of now behind two low-passes, N.
        effect, error_share, learned: as in `examine`.
    """
    difference = residual - 2 * past.residuals[WIDE - 1] + past.residuals[-1]
    changes = forces - 2 * past.forces[WIDE - 1, 0] + past.forces[-1, 0]
    spread = covariance + _WIDE_FLOOR * jnp.eye(len(residual)) + _unknown(effect, error_share * changes)
    wide = weighed(effect, spread, difference)
    return Wide(wide, changes), _learned(covariance, learned, difference, wide.total)


def cleared(state: OnsetState, when: Array) -> OnsetState:
    """The state without what was summed, after an alarm: it concerns a thruster that is known by now."""
    none = lambda sums: jnp.where(when, 0.0, sums)
    return state._replace(along=none(state.along), size=none(state.size), total=none(state.total))


def first_weight(examinations: Float[Array, ""], elapsed, memory) -> Float[Array, ""]:
    """Part of the covariance that the next innovation replaces: a mean at first, then fading memory."""
    innovations = examinations - (ONSETS + 2)
    return jnp.where(innovations < 0, 0.0, jnp.maximum(elapsed / memory, 1 / (jnp.maximum(innovations, 0.0) + _FIRST)))


def _unknown(effect: Float[Array, "n m"], forces: PerActuator) -> Float[Array, "n n"]:
    """Covariance of forces of these standard deviations."""
    columns = forces[None, :] * effect
    return (columns[:, None, :] * columns[None, :, :]).sum(-1)


def _learned(covariance: Float[Array, "n n"], part, vector: PerAxis, size) -> Float[Array, "n n"]:
    """Covariance of which a part is replaced by the square of a vector, less where its weighed size is large."""
    weight = part * jnp.minimum(1.0, _CLIP * len(vector) / jnp.where(size > 0, size, 1.0))
    return covariance * (1 - part) + weight * vector[:, None] * vector[None, :]


def _later(sums: Array) -> Array:
    """Sums since the same onsets, which are one examination further back; that of a new onset begins at zero."""
    return jnp.concatenate([jnp.zeros_like(sums[:1]), sums[:-1]])
