"""Log of the supervisor's transitions: time, new state, reason, and the value and limit that caused it."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from undertow.control.supervision.conditions import NAMES, State, reason_of, state_of

KEPT = 16  # the last ones


class TransitionLog(NamedTuple):
    """The last transitions; number k is in slot k modulo `KEPT`."""

    number: Int[Array, ""]  # since the start
    time: Float[Array, " kept"]  # s
    state: Int[Array, " kept"]
    reason: Int[Array, " kept"]  # code of it
    value: Float[Array, " kept"]
    limit: Float[Array, " kept"]


class SupervisorTransition(NamedTuple):
    """One transition, for people."""

    time: float  # s
    state: State
    reason: str
    value: float
    limit: float

    def __str__(self) -> str:
        return f"{self.time:.6g} s: {self.state.name}{f' ({self.why()})' if self.reason else ''}"

    def why(self) -> str:
        """The reason, with the value and the limit of a condition."""
        return self.reason + (f": {self.value:.4g}, limit {self.limit:.4g}" if self.reason in NAMES else "")


def empty_log() -> TransitionLog:
    """A log without entries."""
    zero, none = jnp.zeros(KEPT), jnp.zeros(KEPT, dtype=int)
    return TransitionLog(jnp.zeros((), dtype=int), zero, none, none, zero, zero)


def logged(log: TransitionLog, changed: Any, entry: tuple[Any, Any, Any, Any, Any]) -> TransitionLog:
    """The log with an entry (time, state, reason, value, limit) if something has changed."""
    slot = jnp.arange(KEPT) == log.number % KEPT

    def written() -> TransitionLog:
        columns = (jnp.where(slot, new, old) for new, old in zip(entry, log[1:], strict=True))
        return TransitionLog(log.number + 1, *columns)

    return jax.lax.cond(changed, written, lambda: log)


def transitions(log: Any) -> Sequence[SupervisorTransition]:
    """The transitions of a log, oldest first; the last `KEPT` of them."""
    count, *columns = jax.tree.map(np.asarray, tuple(log))
    slots = [k % KEPT for k in range(max(0, int(count) - KEPT), int(count))]
    rows = ([column[slot] for column in columns] for slot in slots)
    return [
        SupervisorTransition(float(t), state_of(int(s)), reason_of(c), float(v), float(limit))
        for t, s, c, v, limit in rows
    ]
