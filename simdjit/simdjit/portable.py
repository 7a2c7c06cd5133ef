"""Programs of XLA that a later process can run without tracing their functions."""

import functools
import re
import secrets
from collections.abc import Callable
from typing import Any

import jax
from jax.experimental import serialize_executable
from jax.extend.mlir import passmanager

from simdjit.graph import Unsupported

Arrays = list[Any]

# Code outside of XLA that a program may call: JAX puts it in place in every process that has lowered one such call.
_LAPACK = "lapack_"


class PortableProgram:
    """A function of arrays, compiled for this processor by XLA; it can be pickled.

    XLA's own cache is not asked: what it gives cannot be written.

    Args:
        function: of a list of arrays, giving a list of arrays.
        example: arguments, or their shapes and types.
        name: of the program, for profilers.
        optimize: whether XLA tries hard; without, it compiles in half the time, and results may differ by rounding.

    Raises:
        Unsupported: it calls code that a later process may not have.
    """

    def __init__(
        self, function: Callable[[Arrays], Arrays], example: Arrays, name: str = "program", optimize: bool = True
    ):
        def named(arrays: Arrays) -> Arrays:
            return function(arrays)

        named.__name__ = f"{name}_{secrets.token_hex(8)}"  # under a new name XLA's cache has none
        lowered = jax.jit(named).lower(example)
        _forget_lines(lowered)
        calls = re.findall(r"custom_call[ @\"]+(\w+)", lowered.as_text())
        if further := [call for call in calls if not call.startswith(_LAPACK)]:
            raise Unsupported(f"a program that calls {further[0]}")
        self._calls_lapack = bool(calls)
        self._counts = len(example), len(jax.tree.leaves(lowered.out_info))
        self._run = lowered.compile(None if optimize else {"xla_backend_optimization_level": "0"})

    def __call__(self, arrays: Arrays) -> Arrays:
        """Results, arrays of JAX."""
        return self._run(arrays)

    def __getstate__(self) -> tuple[bytes, tuple[int, int], bool]:
        return serialize_executable.serialize(self._run)[0], self._counts, self._calls_lapack

    def __setstate__(self, state: tuple[bytes, tuple[int, int], bool]) -> None:
        executable, self._counts, self._calls_lapack = state
        if self._calls_lapack:
            _load_lapack()
        takes, gives = self._counts
        forms = jax.tree.structure((([0] * takes,), {})), jax.tree.structure([0] * gives)
        self._run = serialize_executable.deserialize_and_load(executable, *forms, "cpu")


def _forget_lines(lowered: jax.stages.Lowered) -> None:
    """Remove the names and lines of Python from a program: a quarter of the time that loading it takes."""
    module = lowered.compiler_ir()
    assert module is not None
    with module.context:
        passmanager.PassManager.parse("builtin.module(strip-debuginfo)").run(module.operation)


@functools.cache
def _load_lapack() -> None:
    """Let JAX put LAPACK in place. A program that called it before would jump to nowhere."""
    jax.jit(jax.lax.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), float))
