"""Compiled programs that are kept from one process to the next, and found again without tracing.

JAX keeps the machine code of a program, but traces and lowers its Python code in every process to find out which one
it needs: for a vehicle that takes a hundred times as long as to run it. Here the structure of the arguments says which
one it is (`structure_key`). With it belong the sources of undertow, the versions of all libraries, the settings of JAX
and the kind of processor.

Nothing is kept or found where `installation.may_keep` says no: beside code of others.
"""

import functools
import pickle
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import equinox as eqx
import jax
from jax.core import Tracer

from undertow.core.arrays import in_numbers, with_arrays
from undertow.core.installation import may_keep
from undertow.core.kept_code import KEEPS, kept_code
from undertow.core.program_key import KeptKey, kept_key, program_key
from undertow.core.structure_key import Constant, arrays_of, joined

if TYPE_CHECKING or KEEPS:
    from simdjit import PortableProgram, Unsupported

Result = TypeVar("Result")

_MOST_VALUES = 20  # new ones of a function that a process keeps


def kept_program(function: Callable[..., Any], optimize: bool = True) -> Callable[..., Any]:
    """Compile a pure function of trees of parts, as `eqx.filter_jit` does, and keep its programs.

    Args:
        function: of positional arguments; its result is a tree of arrays. It may read nothing that changes but them.
            Arrays of NumPy among them count as arrays of JAX do.
        optimize: whether XLA tries hard; see `briefly_compiled`.
    """
    compiled = eqx.filter_jit(function)
    programs: dict[str, _Program | None] = {}

    @functools.wraps(function)
    def run(*arguments: Any) -> Any:
        # In a key the numbers of arrays of NumPy count, and no other run would find the program.
        arguments = with_arrays(arguments)
        key = program_key(Constant(function), arguments) if KEEPS and may_keep() else None
        if key is None:
            return compiled(*arguments)
        if key not in programs:
            kept = kept_key(key)
            programs[key] = None if kept is None else _program(function, arguments, kept, optimize)
        program = programs[key]
        return compiled(*arguments) if program is None else program(arguments)

    return run


def briefly_compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """A `kept_program` that XLA compiles in half the time to slower code, whose results may differ by rounding.

    It is for large functions that are called a few times, and whose results enter no run.
    """
    return kept_program(function, optimize=False)


def kept_values(function: Callable[..., Any]) -> Callable[..., Any]:
    """Keep what a pure function gave for the numbers of its arguments, for later processes.

    It is for what follows from the numbers of a vehicle or a gain rule and takes hundredths of a second, such as a
    program that calls LAPACK, with which SciPy is loaded. A file is read in a thousandth.

    Args:
        function: of positional arguments, trees of numbers and arrays. Its result can be pickled.
    """
    name, made = f"{function.__module__}.{function.__qualname__}", []

    @functools.wraps(function)
    def run(*arguments: Any) -> Any:
        # A process that makes vehicles by the thousand, as a search does, would keep a file of each.
        if len(made) >= _MOST_VALUES or any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(arguments)):
            return function(*arguments)

        def compute() -> Any:
            made.append(None)
            return function(*arguments)

        with in_numbers():  # an array made during tracing would belong to that trace
            return kept_result(name, Constant(arguments), compute)

    return run


def kept_result(name: str, subject: Any, compute: Callable[[], Result]) -> Result:
    """What `compute` gives for a tree of parts, or gave in an earlier process.

    Args:
        name: of what is computed.
        subject: all that it depends on; numbers of arrays count in what is a `Constant`.
        compute: its result can be pickled; an error that it raises is not kept.
    """
    key = program_key(name, subject)
    kept = None if key is None else kept_key(key)
    if kept is None:
        return compute()
    return pickle.loads(kept_code(kept, lambda: pickle.dumps(compute())))


class _Program:
    """A compiled program and the form of its result."""

    def __init__(self, function: Callable[..., Any], arguments: Any, optimize: bool):
        arrays, rest = arrays_of(arguments)
        forms = []

        def of_arrays(arrays: list[Any]) -> list[Any]:
            results, further = eqx.partition(function(*joined(arrays, rest)), eqx.is_array)
            if jax.tree.leaves(further):
                raise Unsupported("a result that is more than arrays")
            leaves, form = jax.tree.flatten(results)
            forms.append(form)
            return leaves

        self._program = PortableProgram(of_arrays, arrays, function.__name__, optimize)
        (self._form,) = forms

    def __call__(self, arguments: Any) -> Any:
        arrays = [leaf for leaf in jax.tree.leaves(arguments) if eqx.is_array(leaf)]  # in the order of `arrays_of`
        return jax.tree.unflatten(self._form, self._program(arrays))


def _program(function: Callable[..., Any], arguments: Any, kept: KeptKey, optimize: bool) -> _Program | None:
    """The program of a function for arguments of this structure; None where it cannot be kept."""
    contents = kept_code(kept, lambda: _made(function, arguments, optimize))
    try:
        return pickle.loads(contents) if contents else None
    except Exception:  # whatever XLA, or another version of JAX, says of machine code that it does not take
        return None


def _made(function: Callable[..., Any], arguments: Any, optimize: bool) -> bytes:
    """A program for a file; empty where it cannot be kept."""
    try:
        program = _Program(function, arguments, optimize)
    except Unsupported:
        return b""
    try:
        return pickle.dumps(program)
    except Exception:  # constants of a program, or a form that has no name, cannot be kept
        return b""
