"""The sampled loop in the lanes of vector registers: any number of runs of one kind at once.

Same figures as `sampled.simulate` to rounding; their bits do not depend on the machine, nor on who flies beside.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PRNGKeyArray

from undertow.core.contracts import Outputs
from undertow.core.status import Status
from simdjit.cuda import Driver
from simdjit.program import Program
from undertow.loop import sampled
from undertow.loop.closed_loop import ClosedLoop, Sample
from undertow.loop.outcome import Outcome
from undertow.loop.recording import instant
from undertow.numerics.integrators import METHODS


class Run(NamedTuple):
    """Everything that may differ between runs of one kind: trees of arrays, and what is no array is the same."""

    loop: ClosedLoop
    accumulators: tuple[sampled.AbstractAccumulator, ...]
    start: tuple[Outputs, Outputs]
    key: PRNGKeyArray


class Plan(NamedTuple):
    """How a run is run.

    Attributes:
        ticks: how many.
        dt: sampling time, s.
        every: ticks per record; 0 for none.
        signals: of a `Sample`, which are recorded.
        method, substeps: integration of the plant within one tick.
    """

    ticks: int
    dt: float
    every: int
    signals: tuple[str, ...]
    method: str
    substeps: int

    def times(self) -> Float[np.ndarray, " records"]:
        """Of the records, s."""
        return np.arange(0, self.ticks + 1, self.every) * self.dt


class Ended(NamedTuple):
    """Runs at their end, one entry each: as in `Outcome`."""

    accumulated: Any
    final: Any
    status: np.ndarray
    ended: np.ndarray
    input: np.ndarray
    time: np.ndarray
    series: dict[str, Any]


class Fleet:
    """Runs of one kind, compiled once.

    Args:
        run: one of them.
        plan: how they are run.
        constant: which arrays of `run` are the same for all, in the order of its leaves; they make the program short.
        lanes: runs at once; as many as fit a register unless given.
        driver: of the GPU that flies them; None for this processor.

    Raises:
        Unsupported: a part needs something that lanes cannot do.
        OSError: the GPU's driver fails.
    """

    def __init__(self, run: Run, plan: Plan, constant: list[bool], lanes: int = 0, driver: Driver | None = None):
        numbers, rest = eqx.partition(run, eqx.is_array)
        self._plan = plan
        step, dt = METHODS[plan.method], plan.dt

        def draw(numbers):
            loop, accumulators, at, key = eqx.combine(numbers, rest)
            return loop.draw(key), accumulators, at

        def start(known):
            drawn, accumulators, at = known
            return sampled.begin(drawn, at, accumulators)

        def tick(known, carry, k):
            drawn, accumulators, _ = known
            return sampled.tick(drawn, accumulators, jnp.asarray(dt), step, plan.substeps, carry, k)

        def look(known, carry, k):
            t = instant(k, jnp.asarray(dt))
            sample = known[0].look(t, *carry[0])
            return t, {name: getattr(sample, name) for name in plan.signals}

        self._program = Program(draw, start, tick, look, numbers, constant, lanes, driver)

    @property
    def operations(self) -> int:
        """Arithmetic operations of one step of one run: law, plant and its integration, what is accumulated."""
        return self._program.operations

    def fly(self, numbers: Any, ticks: int | None = None) -> Ended:
        """Run them.

        Args:
            numbers: arrays of the runs, as in `run`, with a leading axis over runs.
            ticks: how many; as planned unless given.
        """
        ticks, every = self._plan.ticks if ticks is None else ticks, self._plan.every
        carry, (time, series) = self._program.run(numbers, ticks, every)
        states, accumulated, (status, ended, wrong) = carry
        ended = np.where(status == int(Status.OK), ticks * self._plan.dt, ended)
        return Ended(accumulated, states[:2], status, ended, wrong, time, series)


def simulate(
    loop: ClosedLoop,
    *,
    duration: float,
    dt: float = 1e-3,
    key: PRNGKeyArray | None = None,
    position: Any = None,
    velocity: Any = None,
    record_every: int = 10,
    accumulators: tuple[sampled.AbstractAccumulator, ...] = (),
    method: str = "rk4",
    substeps: int = 1,
) -> Outcome:
    """One run; arguments, result and errors of `sampled.simulate`.

    Raises:
        Unsupported: a part needs something that lanes cannot do.
    """
    ticks, loop = sampled.ticks_of(duration, dt, record_every), loop.beginning_at(position)
    start = loop.outputs_at_start(position, velocity)
    run = Run(loop, accumulators, start, jax.random.PRNGKey(0) if key is None else key)
    arrays = eqx.filter(run, eqx.is_array)
    constant = [True] * len(jax.tree.leaves(arrays))
    plan = Plan(ticks, dt, record_every, Sample._fields, method, substeps)
    fleet = Fleet(run, plan, constant, lanes=1)
    flown = fleet.fly(jax.tree.map(lambda leaf: np.asarray(leaf)[None], arrays))
    one = jax.tree.map(lambda leaf: leaf[0] if isinstance(leaf, np.ndarray) else leaf, flown)
    return Outcome(one.time, Sample(**one.series), one.accumulated, one.final, one.status, one.ended, one.input)
