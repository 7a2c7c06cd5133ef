"""Precision and device of a run: set while it runs, in the thread that computes it only.

Importing undertow changes no setting of JAX. A part that is made outside of a run holds double precision, whatever
`jax_enable_x64` is; a run converts its parts to its own precision.
"""

import functools
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar

import jax

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

_SINGLE = (
    "a part that is used by itself computes in single precision here, in which fits stop early. "
    "Call `undertow.prepare()` first, or set JAX_ENABLE_X64=1"
)

# Precision of the run that this thread computes; None outside of a run.
_stated: ContextVar[str | None] = ContextVar("undertow_precision", default=None)


@contextmanager
def in_precision(precision: str) -> Iterator[None]:
    """Context in which JAX uses float64 or float32, in this thread only."""
    outside = _stated.set(precision)
    try:
        with jax.enable_x64(precision == "float64"):
            yield
    finally:
        _stated.reset(outside)


def double_outside_runs(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Wrap a function that makes parts: double precision outside of a run, the precision of the run inside."""

    @functools.wraps(function)
    def made(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        if _stated.get() is not None or jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
            return function(*arguments, **options)
        with in_precision("float64"):
            return function(*arguments, **options)

    return made


def says_single(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Wrap a function with which somebody begins to compute with a part: warns of single precision outside of a run."""

    @functools.wraps(function)
    def called(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        double = jax.config.jax_enable_x64  # pyright: ignore[reportAttributeAccessIssue]
        if _stated.get() is None and not double:
            warnings.warn(_SINGLE, stacklevel=2)
        return function(*arguments, **options)

    return called


def current_precision() -> str:
    """Precision in which this thread computes: float64 or float32."""
    double = jax.config.jax_enable_x64  # pyright: ignore[reportAttributeAccessIssue]
    return "float64" if double else "float32"


def workers(count: int) -> ThreadPoolExecutor:
    """Threads that compute in the precision of the calling thread."""
    precision, of_thread = current_precision(), threading.local()

    def begin() -> None:
        of_thread.context = in_precision(precision)  # which ends when nothing refers to it
        of_thread.context.__enter__()

    return ThreadPoolExecutor(count, initializer=begin)


def on_processor() -> AbstractContextManager[Any]:
    """Context in which JAX uses the CPU: thousands of small operations are slow on a GPU."""
    try:
        return jax.default_device(jax.devices("cpu")[0])
    except RuntimeError:  # JAX_PLATFORMS excludes it
        return nullcontext()
