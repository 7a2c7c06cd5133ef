"""Faults whose effect is small or grows slowly: examinations of the residual over seconds, in two series."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.supervision.fault_hypotheses import FaultThresholds, one_thruster
from undertow.control.supervision.fault_onset import OnsetState, cleared, examine, onset_state

PerActuator = Float[Array, " m"]

# Examinations of a sudden onset from one of a gradual onset to the next one of its series.
RARELY = 6
# Onsets and residuals to which it looks back.
GRADUAL_ONSETS, _RESIDUALS = 5, 2
# Shares of the nominal force that are missing of a thruster that is off, and the part of what is more than noise that
# it must explain: errors of the model in fast manoeuvres resemble a part of a thruster, or leave more unexplained.
_LEAST_SHARE, _MOST_SHARE, _EXPLAINED = 0.6, 1.9, 0.8


class Gradual(NamedTuple):
    """What one of the two series keeps."""

    onsets: OnsetState
    suspected: PerActuator  # for how long each actuator has been suspected, s
    evidence: Float[Array, ""]  # that one has failed, relative to the threshold; 0 where none was found

    def without_sums(self, when: Array) -> "Gradual":
        """Without what concerns a thruster that is known to be lost by now."""
        return self._replace(onsets=cleared(self.onsets, when), suspected=jnp.where(when, 0.0, self.suspected))


# The series whose turn is next, and the other one. An onset in the middle between two examinations of one series
# resembles no onset at an examination; the other series has an examination there.
Series = tuple[Gradual, Gradual]


def gradual_state(axes: int, actuators: int) -> Series:
    """State before the first examination."""
    onsets = onset_state(axes, actuators, GRADUAL_ONSETS, _RESIDUALS, columns=1)
    unsuspected = Gradual(onsets, jnp.zeros(actuators), jnp.zeros(()))
    return unsuspected, unsuspected


def gradual_bounds(square: Float[Array, ""], margin: Float[Array, ""], force: PerActuator) -> FaultThresholds:
    """What a thruster that is off must satisfy; arguments as in `FaultThresholds`."""
    return FaultThresholds(square, margin, force, _LEAST_SHARE, _MOST_SHARE, _EXPLAINED)


def examine_next(
    series: Series,
    residual: Float[Array, " n"],
    forces: PerActuator,
    effect: Float[Array, "n m"],
    error_share: PerActuator,
    remains: Float[Array, "k+1 3"],
    learned: Float[Array, ""],
    used: PerActuator,
    bounds: FaultThresholds,
    elapsed: Float[Array, ""],
) -> Series:
    """Both series after an examination by the one whose turn it is.

    From one examination to the next both low-passes settle, so that the force behind them stands for all three forces.

    Args:
        series: until now.
        forces: nominal ones of now behind two low-passes, N.
        remains: that of `transients`.
        residual, effect, error_share, learned: as in `fault_onset.examine`.
        used, bounds: as in `fault_hypotheses.one_thruster`.
        elapsed: time since the examination before of the same series, s.
    """
    past, waiting = series
    of_all = remains.sum(1, keepdims=True)
    onsets, missing = examine(past.onsets, residual, forces[None], effect, error_share, of_all, learned)
    suspect, explained = one_thruster(onsets, missing, used, bounds)
    suspected = jnp.where(suspect > 0, past.suspected + elapsed, jnp.maximum(past.suspected - elapsed / 2, 0.0))
    evidence = jnp.where(suspect.any(), jnp.sqrt(explained / bounds.square), 0.0)
    return waiting, Gradual(onsets, suspected, evidence)
