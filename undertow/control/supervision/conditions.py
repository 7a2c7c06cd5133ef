"""The table of the supervisor: its states, the conditions that lead to them, and after which time.

Code, documentation and tests are made from `CONDITIONS`: there is no second list.
"""

import enum
import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from undertow.core.arrays import as_array

PerCondition = Float[Array, " conditions"]


class State(enum.IntEnum):
    """State of the supervisor. Only in ACTIVE and DEGRADED the input is that of the controller."""

    INIT = 0
    READY = 1
    ACTIVE = 2
    DEGRADED = 3
    SAFE = 4
    STOPPED = 5

    @property
    def meaning(self) -> str:
        """What it means, in a sentence."""
        return _MEANINGS[self]


_MEANINGS = {
    State.INIT: "No complete, plausible measurement has come yet. The output is the safe one.",
    State.READY: "Measurements are plausible, and control may begin. The output is the safe one.",
    State.ACTIVE: "The controller controls, and no condition of the table is present.",
    State.DEGRADED: "The controller controls, under the condition that is named as the reason.",
    State.SAFE: "The output is the safe one, because of the reason. Control goes on by itself once that is over.",
    State.STOPPED: "The output is the safe one until control is started again.",
}


class Request(enum.IntEnum):
    """What the operator wants."""

    RUN = 0  # whoever controls goes on
    HOLD = 1  # READY: the safe output, until another request
    STOP = 2
    LAW = 3  # the law controls
    FALLBACK = 4  # the fallback controls


class Condition(NamedTuple):
    """A condition, which holds while its value exceeds its limit.

    Attributes:
        name: the reason as it is recorded.
        value: what is compared.
        limit: what with; an option of the supervisor in backquotes.
        degraded_after, safe_after: time for which it has to hold before the state changes, s; inf for never. Time for
            which it does not hold is taken off again, so that what comes and goes counts as what stays.
        recovers_after: time without it after which it counts no longer, s; inf for never.
        reaction: what else is done.
    """

    name: str
    value: str
    limit: str
    degraded_after: float
    safe_after: float
    recovers_after: float
    reaction: str

    def cells(self) -> tuple[str, ...]:
        """Its line in the table of the documentation, under `HEAD`."""
        seconds = lambda time: "never" if time == math.inf else f"{time:g} s" if time else "at once"
        return (self.name, self.value, self.limit, *map(seconds, self[3:6]), self.reaction)


HEAD = ("reason", "holds while", "exceeds", "DEGRADED after", "SAFE after", "over after", "reaction")

_NEVER = math.inf
_PREDICTED = "The model's prediction takes the place of the reading; the law does not adapt to it"
_RESTART = "The law starts again from the present measurement; its output turns no faster than `slew`"

CONDITIONS = (
    Condition("measurement_not_finite", "readings that are NaN or infinite", "0", 0.05, 0.5, 1.0, _PREDICTED),
    Condition(
        "measurement_implausible",
        "size of a reading relative to the largest possible one",
        "1, of `max_distance`, `max_speed` and `max_rate`",
        0.05,
        0.5,
        1.0,
        _PREDICTED,
    ),
    Condition(
        "measurement_jump",
        "difference between a reading and its prediction",
        "1, of `jump_position`, `jump_angle`, `jump_velocity` and `jump_rate`",
        0.05,
        0.5,
        1.0,
        _PREDICTED + ". In SAFE the new value is taken as the truth",
    ),
    Condition(
        "measurement_inconsistent",
        "way by which position and integral of the velocity contradict each other, or attitude and angular velocity; "
        "forgotten within 2 s",
        "1, of `jump_position` and `jump_angle`",
        0.0,
        0.2,
        1.0,
        "None: nobody knows which of them is wrong",
    ),
    Condition(
        "measurement_noisy",
        "mean difference between readings and their predictions within 1 s",
        "0.1 of `jump_position`, `jump_angle`, `jump_velocity` or `jump_rate`",
        0.0,
        1.0,
        1.0,
        "",
    ),
    Condition(
        "measurement_stuck",
        "motion missing from readings of the same bits, ten times or for three times `update_period`",
        "1, of `stuck_distance` and `stuck_angle`",
        0.0,
        5.0,
        1.0,
        _PREDICTED,
    ),
    Condition(
        "report_lost",
        "entries of the report of the actuators that are not finite, or beyond 1e5 rad/s",
        "0",
        0.05,
        _NEVER,
        1.0,
        "The last report is held",
    ),
    Condition(
        "applied_contradicted",
        "log-likelihood ratio of the commanded against the reported input, from the motion and the nominal model, "
        "relative to 4; or changes of the command that the report did not follow, relative to the range of the input",
        "1",
        0.0,
        _NEVER,
        1.0,
        "The command counts as applied",
    ),
    Condition(
        "reference_rejected",
        "entries of the reference that are not finite, or beyond `max_distance`, `max_speed` or `max_rate`",
        "0",
        0.0,
        _NEVER,
        1.0,
        "The last valid reference is held, at rest",
    ),
    Condition(
        "place_held",
        "whether control began again after readings had jumped or contradicted each other",
        "0",
        0.0,
        _NEVER,
        0.0,
        "The place where control began again is held, until the operator asks for `run` or gives another target",
    ),
    Condition(
        "output_not_finite",
        "inputs of the law's command that are not finite",
        "0",
        0.0,
        0.0,
        1.0,
        "The safe output takes its place in the same step. " + _RESTART,
    ),
    Condition(
        "estimator_diverged",
        "estimated uncertainty relative to ten times the acceleration of the actuators, or a law's state that is not "
        "finite",
        "1, or `max_estimate`",
        0.1,
        _NEVER,
        1.0,
        _RESTART,
    ),
    Condition(
        "restarts_exhausted",
        "restarts of the law within ten minutes",
        "`restarts`",
        0.0,
        0.0,
        _NEVER,
        "The `fallback` controls, if there is one, and the state is DEGRADED",
    ),
    Condition("saturated", "inputs at their limit", "0", 1.0, _NEVER, 1.0, "The law knows the applied input"),
    Condition(
        "chattering",
        "variation of the input relative to `max_variation`, or swings of a thruster from limit to limit relative to "
        "0.8 per second",
        "1",
        1.0,
        5.0,
        1.0,
        "The `fallback` controls, if there is one",
    ),
    Condition(
        "reference_infeasible", "share of the desired acceleration that cannot be given", "0.05", 1.0, _NEVER, 1.0, ""
    ),
    Condition(
        "thruster_lost",
        "thrusters that are announced or found to have failed",
        "0",
        0.0,
        _NEVER,
        1.0,
        "They are commanded to zero, and the others take over what they can",
    ),
    Condition(
        "axes_lost",
        "axes that the remaining thrusters cannot control",
        "0",
        0.0,
        _NEVER,
        1.0,
        "They are announced in the signal `lost_axes`",
    ),
    Condition("near_vertical", "pitch, of a law in Euler angles", "75 degrees", 0.0, 0.5, 1.0, ""),
    Condition(
        "position_error",
        "tracking error in position relative to the allowed one",
        "1, of `max_position_error` and what the start and jumps of the reference add",
        0.2,
        10.0,
        1.0,
        "",
    ),
    Condition(
        "attitude_error", "the same of the attitude", "1, of `max_angle_error` and what is added", 0.2, 2.0, 1.0, ""
    ),
    Condition(
        "overrun",
        "time since the last step, sampling times",
        "1.5",
        0.0,
        _NEVER,
        1.0,
        "The law advances by three sampling times at most",
    ),
    Condition(
        "clock_fault",
        "time since the last step not positive, not finite or above ten sampling times",
        "0",
        0.0,
        _NEVER,
        1.0,
        "The law advances by the sampling time",
    ),
)

NAMES = tuple(condition.name for condition in CONDITIONS)
NUMBER = {name: k for k, name in enumerate(NAMES)}

OPERATOR = "operator"  # the reason of a state that was asked for
MEMORY = "memory_damaged"  # the reason of a start in the middle of a run: a number of the supervisor was not finite
_REASONS = ("", *NAMES, OPERATOR, MEMORY)


def state_of(code: int) -> State:
    """State of a code; INIT, in which nobody controls, for one of a damaged memory."""
    return State(code) if code in set(State) else State.INIT


def reason_of(code: int) -> str:
    """Reason of a code as it is recorded: "" for none. Codes of a damaged memory have no reason."""
    return dict(enumerate(_REASONS)).get(int(code), "")


def code_of(reason: str) -> int:
    """The recorded code of a reason."""
    return _REASONS.index(reason)


class Conditions(NamedTuple):
    """State of the conditions."""

    held: PerCondition  # for how long each has held, less the time for which it has not, s
    clear: PerCondition  # for how long it has not, s
    level: PerCondition  # 0; 1 for DEGRADED; 2 for SAFE


def none_held() -> Conditions:
    """The state in which none has ever held."""
    zero = jnp.zeros(len(CONDITIONS))
    return Conditions(zero, zero, zero)


def held_for(
    state: Conditions, holds: Bool[Array, " conditions"], dt: Float[Array, ""], tolerated: Bool[Array, " conditions"]
) -> Conditions:
    """The state one step later.

    Args:
        state: before.
        holds: which hold now.
        dt: time since the last step, s.
        tolerated: which cannot lead to SAFE.
    """
    degraded, safe, recovers = _times()
    held = jnp.maximum(state.held + jnp.where(holds, dt, -dt), 0.0)
    clear = jnp.where(holds, 0.0, state.clear + dt)
    # A step counts in whole: what holds at k instants has held for k sampling times.
    level = jnp.where(holds & (held >= degraded * _WHOLE), 1.0, 0.0)
    level = jnp.where(holds & (held >= safe * _WHOLE), jnp.where(tolerated, 1.0, 2.0), level)
    previous = jnp.where(clear >= recovers * _WHOLE, 0.0, state.level)
    previous = jnp.where(tolerated, jnp.minimum(previous, 1.0), previous)
    return Conditions(held, clear, jnp.maximum(level, previous))


# Sums of sampling times are rounded.
_WHOLE = 1 - 1e-6


def _times() -> tuple[PerCondition, PerCondition, PerCondition]:
    rows = np.array([condition[3:6] for condition in CONDITIONS])
    return tuple(as_array(column) for column in rows.T)  # pyright: ignore[reportReturnType] - three columns


def state_of_levels(level: PerCondition) -> tuple[Int[Array, ""], Int[Array, ""]]:
    """State that the levels of the conditions ask for, and the code of its reason."""
    top = level.max()
    first = jnp.where(level >= top, jnp.arange(len(CONDITIONS)), len(CONDITIONS)).min()
    state = jnp.where(top >= 2, int(State.SAFE), jnp.where(top >= 1, int(State.DEGRADED), int(State.ACTIVE)))
    return state.astype(int), jnp.where(top > 0, first + 1, 0).astype(int)
