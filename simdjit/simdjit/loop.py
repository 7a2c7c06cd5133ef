"""A loop over steps, written for one run and compiled for any number of them at once."""

import json
import pickle
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from simdjit import estimate, nvidia
from simdjit.cache import cached
from simdjit.codegen import STEP, VECTORS, Head, Sections, assembly, operations
from simdjit.cpu import Code, Optimize, simd_width
from simdjit.cuda import Driver
from simdjit.fingerprint import fingerprint
from simdjit.graph import I64, Unsupported, flat
from simdjit.layout import Layout
from simdjit.lowering import TooLong, evaluate
from simdjit.prologue import Prologue, RunInputs, inputs
from simdjit.tracing import Form, Traced

# Operations; machine code of a longer program would take minutes to make, whatever the estimate for XLA is.
_MOST = 200_000


class Loop:
    """A time-stepping loop, compiled for vector registers or for a GPU.

    Args:
        prepare: numbers -> everything that does not change from step to step, random draws included.
        start: prepared -> carry.
        step: prepared, carry, number of the step -> carry.
        record: prepared, carry, number of the step -> what is recorded of an instant.
        numbers: of one run; a tree of arrays.
        constant: which leaves of `numbers` are the same in every run; they make the program short. None for none.
        lanes: runs at once; as many as fit a register unless given. No result depends on it.
        driver: of the GPU that runs it, as `gpu` finds it; None for this processor. No result depends on it.
        cache: folder of compiled code; None for SIMDJIT_CACHE or the default.
        planned: steps of all runs together for which the program is made; 0 where it is wanted whatever it costs.
        portable: whether it will be `written`.
        optimize: whether the machine code is to be as fast as it can be. Without, it is made in a third of the time and
            takes half as long again: worth it for some ten thousand steps. "later": a thread makes the fast one where
            it is run often after all. No result depends on it.
        most: operations of start, step and record together, in all of the program.

    Raises:
        Unsupported: a function needs something that the compiler has no rule for, or XLA would take less time for the
            planned steps, compiling included (see `estimate`).
        OSError: the GPU's driver fails.
    """

    def __init__(
        self,
        prepare: Callable,
        start: Callable,
        step: Callable,
        record: Callable,
        numbers: Any,
        constant: Sequence[bool] | None = None,
        lanes: int = 0,
        driver: Driver | None = None,
        cache: Path | None = None,
        planned: int = 0,
        portable: bool = False,
        optimize: Optimize = True,
        most: int = _MOST,
    ):
        prepared = Traced(prepare, numbers)
        constant = [False] * len(jax.tree.leaves(numbers)) if constant is None else constant
        of_arrays = lambda function: lambda arrays, *rest: function(eqx.combine(arrays, prepared.still), *rest)
        begun = Traced(of_arrays(start), prepared.shapes)
        number = jax.ShapeDtypeStruct((), jnp.asarray(0).dtype)
        carried = lambda function: lambda known, carry, k: function(known, eqx.combine(carry, begun.still), k)
        stepped, recorded = (
            Traced(of_arrays(carried(function)), prepared.shapes, begun.shapes, number) for function in (step, record)
        )
        if stepped.types != begun.types:
            raise Unsupported("a carry that changes its type")
        prologue = Prologue(prepared, numbers, constant, portable)
        lanes = nvidia.LANES if driver else lanes or simd_width(8 * np.dtype(number.dtype).itemsize)
        head = nvidia.THREADS if driver else VECTORS
        traced = (prepared, begun, stepped, recorded)
        beside = simd_width(64) if lanes == 1 and not driver else 1
        made = lambda: _lowered(prologue, traced, number.dtype, lanes, head, beside, planned, most)
        name = fingerprint(
            [function.closed for function in traced], prologue.constants, lanes, beside, bool(driver), planned, most
        )
        program = Program.read(cached(name, ".ll", lambda: made().written(), cache)) if name else made()
        if program.prologue_lacks and not prologue.lacking:
            prologue.leave_to_xla(program.prologue_lacks)
        read, carry, series = (Layout(leaves, lanes) for leaves in (prologue.inputs, begun.leaves, recorded.leaves))
        forms = stepped.form, recorded.form
        self._load(_Parts(program, lanes, prologue.of_runs(), read, carry, series, *forms, optimize), driver, cache)

    @classmethod
    def recording(
        cls,
        function: Callable,
        example: tuple[Any, ...],
        constant: Sequence[bool] | None = None,
        lanes: int = 0,
        driver: Driver | None = None,
        cache: Path | None = None,
        portable: bool = False,
        optimize: Optimize = True,
        most: int = _MOST,
    ) -> "Loop":
        """A loop that carries nothing from step to step and records what a function gives for its numbers.

        Args:
            function: of as many trees of arrays as `example` has.
            example: its arguments for one run.
            constant, lanes, driver, cache, portable, optimize, most: as of a loop.

        Raises:
            Unsupported, OSError: as of a loop.
        """
        nothing = np.zeros(())
        record = lambda arguments, carry, k: function(*arguments)
        functions = lambda arguments: arguments, lambda arguments: nothing, lambda arguments, carry, k: carry, record
        return cls(*functions, example, constant, lanes, driver, cache, portable=portable, optimize=optimize, most=most)

    def _load(self, parts: "_Parts", driver: Driver | None, cache: Path | None) -> None:
        self._parts, self.operations = parts, parts.program.operations
        assembly = parts.program.assembly
        if driver:
            self._code = nvidia.Kernel(assembly, driver, cache)
        else:
            self._code = Code(assembly, cache, sparing=parts.lanes > 1, optimize=parts.optimize)

    def written(self) -> bytes:
        """For a file: what `Loop.read` makes the loop of, in another process and without its functions.

        Raises:
            Unsupported: it is for a GPU, or results of its functions hold something that cannot be written.
        """
        if not isinstance(self._code, Code):
            raise Unsupported("a loop of a GPU cannot be written")
        try:
            return zlib.compress(pickle.dumps(self._parts), level=1)
        except Exception as error:  # whatever pickle, or the code of a part, says of what it cannot write
            raise Unsupported(f"a loop that cannot be written ({error})") from error

    @classmethod
    def read(cls, written: bytes, cache: Path | None = None) -> "Loop":
        """The loop that was `written`, on a processor of the same kind and with the same versions of libraries.

        Args:
            written: by the user's own process: it is trusted as code is.
            cache: folder of compiled code; None for SIMDJIT_CACHE or the default.
        """
        loop = cls.__new__(cls)
        loop._load(pickle.loads(zlib.decompress(written)), None, cache)
        return loop

    def run(self, numbers: Any, steps: int, every: int = 0) -> tuple[Any, Any]:
        """Run the loop for a batch.

        Args:
            numbers: as in the example, with a leading axis over runs.
            steps: how many.
            every: steps between records, the first before the first step; 0 for none.

        Returns:
            The carry after the last step, and what was recorded, with an axis over records; both with a leading axis
            over runs.
        """
        runs = len(jax.tree.leaves(numbers)[0])
        parts = self._parts
        memory = parts.numbers.packed(parts.inputs.packed(numbers), runs)
        carry = parts.carry.memory(len(memory))
        series = parts.record.memory(len(memory), steps // every + 1 if every else 0)
        self._code.run(memory, carry, series, steps, every)
        final = [leaf[:, 0] for leaf in parts.carry.unpacked(carry, runs)]
        return parts.carry_form.whole(final), parts.record_form.whole(parts.record.unpacked(series, runs))

    def kept(self) -> "Kept":
        """What records one instant of one run again and again, in memory that is kept.

        Raises:
            Unsupported: XLA computes what comes before the first step, or a GPU the steps.
        """
        call, memory, series = self._kept(1)
        views = self._parts.numbers.views(memory), self._parts.record.views(series)
        return Kept(call, *views, memory[0, 0], series[0, 0])

    def kept_runs(self, runs: int) -> tuple[Callable[[], None], list[np.ndarray], list[np.ndarray]]:
        """`kept` of many runs: arrays of shape (groups, runs of a group, ...), the last runs of which may be idle."""
        call, memory, series = self._kept(-(-runs // self._parts.lanes))
        parts = self._parts
        return call, parts.numbers.views_of_groups(memory), parts.record.views_of_groups(series)

    def _kept(self, groups: int) -> tuple[Callable[[], None], np.ndarray, np.ndarray]:
        parts, lacking = self._parts, self._parts.program.prologue_lacks
        if lacking or not isinstance(self._code, Code):
            raise Unsupported(lacking or "a GPU that computes one step at a time")
        memory, carry, series = (layout.memory(groups) for layout in (parts.numbers, parts.carry, parts.record))
        return self._code.repeated(memory, carry, series), memory, series


class Kept(NamedTuple):
    """A function without arguments, and the memory that it reads and writes.

    Attributes:
        call: the function.
        numbers, recorded: what it reads and what it records, as arrays in that memory.
        read, written: the same memory, bytes of one slot after the other, in the order of the numbers of these arrays.
    """

    call: Callable[[], None]
    numbers: list[np.ndarray]
    recorded: list[np.ndarray]
    read: np.ndarray
    written: np.ndarray


class Program(NamedTuple):
    """What is kept of a program, so that nobody needs to lower it again.

    Attributes:
        assembly: LLVM's.
        operations: arithmetic ones of one step.
        prologue_lacks: why XLA computes the prologue; empty where the program does.
    """

    assembly: str
    operations: int
    prologue_lacks: str

    def written(self) -> bytes:
        """For a file."""
        return zlib.compress(json.dumps(self).encode(), level=1)

    @classmethod
    def read(cls, written: bytes) -> "Program":
        """From a file."""
        return cls(*json.loads(zlib.decompress(written)))


class _Parts(NamedTuple):
    """A compiled loop without its functions.

    Attributes:
        program: its code.
        lanes: runs at once.
        inputs: what it takes of the numbers of its runs.
        numbers, carry, record: memory of what it reads, hands on from step to step, and records.
        carry_form, record_form: how results are put together.
        optimize: see `Loop`.
    """

    program: Program
    lanes: int
    inputs: RunInputs
    numbers: Layout
    carry: Layout
    record: Layout
    carry_form: Form
    record_form: Form
    optimize: Optimize


def _lowered(
    prologue: Prologue,
    traced: tuple[Traced, Traced, Traced, Traced],
    number: Any,
    lanes: int,
    head: Head,
    beside: int,
    planned: int,
    most: int,
) -> Program:
    """The program of traced functions: prepare, start, step and record."""
    _, begun, step, record = traced
    graph, prepared = prologue.lowered()
    try:
        first = evaluate(graph, begun.closed, prepared, most)
        k = graph.input(STEP, I64)
        k = k if number == I64 else graph.apply("convert", k, dtype=str(number))
        arguments = [*prepared, *inputs(graph, "carry", begun.leaves), np.array(k)]
        stepped, recorded = (evaluate(graph, function.closed, arguments, most) for function in (step, record))
    except TooLong as error:
        seconds = estimate.compiled_here(most).compiling
        raise Unsupported(f"{error}, which would take more than {seconds:.0f} s to compile") from error
    sections = Sections(*map(flat, (first, stepped, recorded)))
    counts = operations(graph, sections)
    if planned and (why := estimate.reason_for_xla(counts.written, step.closed, planned)):
        raise Unsupported(why)
    return Program(assembly(graph, sections, lanes, head, beside), counts.all, prologue.lacking)
