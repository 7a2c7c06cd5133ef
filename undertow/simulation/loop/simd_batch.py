"""Both loops as SIMD batches: many runs of one kind at once, by the batch compiler.

Results equal those of `sampled.simulate`, or of `continuous.simulate` with fixed steps, to rounding; their bits depend
neither on the machine nor on the other runs.

Without the batch compiler every program is `Unsupported`. What is unsupported runs by XLA: `run_scenario` falls back
for a run, `batch_runner` for many.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PRNGKeyArray

from undertow.core.batch_compiler import Unsupported, simdjit, unavailable
from undertow.core.kept_loops import decides_structure, kept_loop, kept_or_made, numbers_contained
from undertow.core.numerics.integrators import COMPACT_METHODS, METHODS
from undertow.core.process_setup import cache_folder
from undertow.core.program_key import program_key
from undertow.core.status import Status
from undertow.core.structure_key import Constant
from undertow.simulation.loop import continuous, sampled
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import LoopRun, RunPlan, outcome_of
from undertow.simulation.loop.outcome import Outcome
from undertow.simulation.loop.recording import instant


def gpu() -> "simdjit.Driver | None":
    """The GPU that runs SIMD batches; None where there is none."""
    if unavailable():
        return None
    return simdjit.gpu()


def simd_width(bits: int) -> int:
    """How many numbers of `bits` bits fit a vector register of this processor; 1 without the batch compiler."""
    if unavailable():
        return 1
    return simdjit.simd_width(bits)


# Steps of all runs together for which a program must be worth its compile time, say 100 runs of 10 000 steps. The
# number is the same for a campaign and for a trial that is repeated alone, so that both have the same bits.
_PLANNED = 1_000_000

# Steps of all runs together from which on a longer program pays: it takes 0.1 to 0.3 s more to compile.
_FEW = 2_000_000

# Steps of all runs together from which on it pays to have LLVM try hard: for a large vehicle that takes 2 to 10 s more,
# and saves a third of the time of the steps, here half a second.
_SOME = 100_000


def kept_step(function: Callable, numbers: Any, state: Any, inputs: Any) -> Any:
    """`simdjit.Step`: one step of one run, called by somebody else's clock.

    Raises:
        Unsupported: the function uses an operation that the batch compiler lacks, or there is no batch compiler.
    """
    if unavailable():
        raise Unsupported(unavailable())
    example, cache = (numbers, state, inputs), cache_folder() / "native"
    shapes = [(np.shape(leaf), str(np.asarray(leaf).dtype)) for leaf in jax.tree.leaves(example)]
    key = program_key("step", Constant(function), jax.tree.structure(example), shapes)
    make = lambda portable: simdjit.Step(function, *example, cache, portable)
    if key is None:
        return make(False)
    return kept_or_made(key, make, lambda written: simdjit.Step.read(written, *example, cache))


def kept_steps(
    function: Callable, numbers: Any, state: Any, inputs: Any, runs: int, constant: Sequence[bool]
) -> "simdjit.BatchStep":
    """`simdjit.BatchStep`: one step of many runs, called by somebody else's clock.

    Raises:
        Unsupported: as of `kept_step`.
    """
    if unavailable():
        raise Unsupported(unavailable())
    return simdjit.BatchStep(function, numbers, state, inputs, runs, constant, cache_folder() / "native")


def starter(prepare: Callable, begin: Callable, numbers: Any, constant: Sequence[bool]) -> Callable[[Any], Any]:
    """The start of runs as `SimdBatchRunner` makes it: from numbers with a leading axis over runs to results with one.

    Args:
        prepare: numbers -> everything random and what else does not change, as in a run.
        begin: prepared -> results.
        numbers: of one run.
        constant: which of its arrays are equal in all runs.

    Raises:
        Unsupported: as of `kept_step`.
    """
    if unavailable():
        raise Unsupported(unavailable())
    record_start = lambda prepared, carry, k: begin(prepared)
    cache, no_output = cache_folder() / "native", np.zeros(())
    unchanged = lambda prepared, carry, k: carry
    loop = simdjit.Loop(prepare, lambda prepared: no_output, unchanged, record_start, numbers, constant, cache=cache)
    return lambda numbers: jax.tree.map(lambda leaf: leaf[:, 0], loop.run(numbers, 0, 1)[1])


# Numbers of an array; of a larger one, such as the commands of a long log, the program would take a minute to compile.
_LARGEST = 4_000


class SimdBatchRunner:
    """Runs of one kind, compiled once.

    Args:
        run: one of them.
        plan: how they are run.
        constant: which arrays of `run` are equal in all runs, in the order of its leaves; they shorten the program.
        width: runs at once; as many as fit a register unless given.
        driver: that of the GPU; None for this processor.
        runs: how many it is compiled for, where that is known: few steps are worth a shorter program. Any number can
            be run, with the same bits.

    Raises:
        Unsupported: a part uses an operation that the batch compiler lacks, XLA would take less time by estimate, or
            there is no batch compiler.
        OSError: the driver of the GPU fails.
    """

    def __init__(
        self,
        run: LoopRun,
        plan: RunPlan,
        constant: list[bool],
        width: int = 0,
        driver: "simdjit.Driver | None" = None,
        runs: float = math.inf,
    ):
        if unavailable():
            raise Unsupported(unavailable())
        numbers, static = eqx.partition(run, eqx.is_array)
        if (largest := max(leaf.size for leaf in jax.tree.leaves(numbers))) > _LARGEST:
            raise Unsupported(f"a table of {largest} numbers, more than {_LARGEST}")
        self._plan = plan
        # With its stages in a loop a program compiles in nine tenths of the time, and takes up to half as long again.
        compact = driver is None and runs * plan.steps < _FEW
        optimize = True if runs * plan.steps >= _SOME else "later"
        integrate = (COMPACT_METHODS if compact else METHODS)[plan.method]
        dt = plan.dt

        def realize(numbers):
            loop, accumulators, at, key = eqx.combine(numbers, static)
            return loop.realize(key), accumulators, at

        def start(prepared):
            realization, accumulators, at = prepared
            if plan.continuous:
                return continuous.begin(realization, at)
            return sampled.begin(realization, at, accumulators)

        def control_step(prepared, carry, k):
            realization, accumulators, _ = prepared
            if plan.continuous:
                return continuous.step(realization, jnp.asarray(dt), carry, k)
            return sampled.control_step(realization, accumulators, jnp.asarray(dt), integrate, plan.substeps, carry, k)

        def record(prepared, carry, k):
            t = instant(k, jnp.asarray(dt))
            signals = prepared[0].record(t, *carry[0])
            return t, {name: signals[name] for name in plan.signals}

        cache = cache_folder() / "native"
        functions = realize, start, control_step, record

        def make(portable: bool) -> simdjit.Loop:
            return simdjit.Loop(*functions, numbers, constant, width, driver, cache, _PLANNED, portable, optimize)

        contained = numbers_contained(numbers, constant)
        structure = ("runs", run, plan._replace(steps=0), contained, width, compact, optimize)
        self._program = make(False) if driver else kept_loop(structure, make)

    @property
    def operations(self) -> int:
        """Arithmetic operations of one step of one run: law, integration of the plant, accumulators.

        Stages of integration that are a loop are counted once.
        """
        return self._program.operations

    def run(self, numbers: Any, steps: int | None = None) -> Outcome:
        """Run a batch; the outcome has NumPy arrays with a leading axis over runs.

        Args:
            numbers: arrays of the runs, as in `run`, with a leading axis over runs.
            steps: how many; as planned unless given.
        """
        steps, every = self._plan.steps if steps is None else steps, self._plan.every
        carry, (time, signals) = self._program.run(numbers, steps, every)
        states, accumulated, (status, ended, wrong) = carry
        until: Any = np.where(status == int(Status.OK), steps * self._plan.dt, ended)
        return Outcome(time, signals, accumulated, states[:2], status, until, wrong)


def realized_disturbance(loop: ClosedLoop, key: PRNGKeyArray) -> Any:
    """What is random of the disturbance of a run with this key, to the last bit.

    Raises:
        Unsupported: as of `simulate`.
    """
    if unavailable():
        raise Unsupported(unavailable())
    numbers, static = eqx.partition((loop, key), eqx.is_array)

    def realize(numbers):
        loop, key = eqx.combine(numbers, static)
        return loop.realize(key).disturbance_realization

    constant = [decides_structure(leaf) for leaf in jax.tree.leaves(numbers)]
    unchanged = lambda prepared, carry, k: carry
    no_output = lambda prepared, carry, k: jnp.zeros(())
    cache = cache_folder() / "native"
    program = simdjit.Loop(realize, lambda prepared: prepared, unchanged, no_output, numbers, constant, 1, None, cache)
    carry, _ = program.run(jax.tree.map(lambda leaf: np.asarray(leaf)[None], numbers), 1, 0)
    return jax.tree.map(lambda leaf: leaf[0], carry)


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
        Unsupported: a part uses an operation that the batch compiler lacks, or there is no batch compiler.
    """
    steps, loop = sampled.steps_of(duration, dt, record_every), loop.starting_at(position)
    start = loop.outputs_at_start(position, velocity)
    run = LoopRun(loop, accumulators, start, jax.random.PRNGKey(0) if key is None else key)
    return _alone(run, RunPlan(steps, dt, record_every, tuple(loop.signals()), method, substeps))


def integrate(
    loop: ClosedLoop,
    *,
    duration: float,
    record_step: float = 1e-2,
    key: PRNGKeyArray | None = None,
    position: Any = None,
    velocity: Any = None,
    dt: float = 1e-3,
) -> Outcome:
    """One run of plant and law as one ODE; arguments, result and errors of `continuous.simulate` with fixed steps.

    Raises:
        Unsupported: as of `simulate`.
    """
    continuous.check(loop)
    loop, _ = loop.starting_at(position), continuous.records_of(duration, record_step)
    steps, every, dt = continuous.grid_of(duration, record_step, dt)
    start = loop.outputs_at_start(position, velocity)
    run = LoopRun(loop, (), start, jax.random.PRNGKey(0) if key is None else key)
    outcome = _alone(run, RunPlan(steps, dt, every, tuple(loop.signals()), continuous=True))
    return continuous.explained(loop, run.key, outcome, dt)


def _alone(run: LoopRun, plan: RunPlan) -> Outcome:
    arrays = eqx.filter(run, eqx.is_array)
    constant = [decides_structure(leaf) for leaf in jax.tree.leaves(arrays)]
    batch = SimdBatchRunner(run, plan, constant, width=1, runs=1.0)
    return outcome_of(batch.run(jax.tree.map(lambda leaf: np.asarray(leaf)[None], arrays)), 0)
