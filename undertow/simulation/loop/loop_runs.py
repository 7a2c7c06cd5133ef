"""Many runs of closed loops: what one of them is, and the arrays of several of one kind."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, PRNGKeyArray

from undertow.core.contracts import Outputs
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.outcome import Outcome
from undertow.simulation.loop.sampled import AbstractAccumulator


class LoopRun(NamedTuple):
    """What may differ between runs of one kind: the arrays of these trees; the rest is the same for all."""

    loop: ClosedLoop
    accumulators: tuple[AbstractAccumulator, ...]
    start: tuple[Outputs, Outputs]
    key: PRNGKeyArray


class RunPlan(NamedTuple):
    """Time grid, recording and integration of a run.

    Attributes:
        steps: how many.
        dt: sampling time, s.
        every: steps per record; 0 for none.
        signals: names of those that are recorded.
        method, substeps: integration of the plant within one control step.
        continuous: whether plant and controller are integrated together, with `steps` of the classical Runge-Kutta
            method; nothing is accumulated.
    """

    steps: int
    dt: float
    every: int = 0
    signals: tuple[str, ...] = ()
    method: str = "rk4"
    substeps: int = 1
    continuous: bool = False

    def times(self) -> Float[np.ndarray, " records"]:
        """Times of the records, s."""
        return np.arange(0, self.steps + 1, self.every) * self.dt


def numbers_of(run: LoopRun) -> list[Any]:
    """The arrays of a run, in the order of its tree."""
    return [leaf for leaf in jax.tree.leaves(run) if eqx.is_array(leaf)]


def with_numbers(run: LoopRun, numbers: Sequence[Any]) -> LoopRun:
    """A run with other arrays, in the order of `numbers_of`."""
    arrays, static = eqx.partition(run, eqx.is_array)
    return eqx.combine(jax.tree.unflatten(jax.tree.structure(arrays), numbers), static)


def outcome_of(batch: Outcome, run: int) -> Outcome:
    """The outcome of one run of a batch."""
    return jax.tree.map(lambda leaf: leaf[run] if isinstance(leaf, np.ndarray) else leaf, batch)


def structure(tree: Any) -> Any:
    """Everything about a tree of parts except its numbers; equal structures share a compiled program."""
    leaves, form = jax.tree.flatten(tree)
    return form, tuple((leaf.shape, leaf.dtype) if eqx.is_array(leaf) else leaf for leaf in leaves)
