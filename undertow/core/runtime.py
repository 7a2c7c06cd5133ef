"""Precision and device of a run: set for its length, in the thread that computes it, and nowhere else.

Importing undertow changes no setting of JAX. A part that is made outside of any run holds double precision, whatever
`jax_enable_x64` is; a run converts its parts to the precision that it names.
"""

import functools
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar

import jax

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# Precision of the run that this thread computes; None outside of any.
_stated: ContextVar[str | None] = ContextVar("undertow_precision", default=None)


@contextmanager
def in_precision(precision: str) -> Iterator[None]:
    """What JAX makes inside, in this thread, is float64 or float32; other threads, and what comes after, are not."""
    outside = _stated.set(precision)
    try:
        with jax.enable_x64(precision == "float64"):
            yield
    finally:
        _stated.reset(outside)


def double_outside_runs(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A function that makes parts: in double precision outside of any run, in that of the run inside."""

    @functools.wraps(function)
    def made(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        if _stated.get() is not None or jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
            return function(*arguments, **options)
        with in_precision("float64"):
            return function(*arguments, **options)

    return made


def workers(count: int) -> ThreadPoolExecutor:
    """Threads that compute in the precision of the one that asks for them."""
    double = jax.config.jax_enable_x64  # pyright: ignore[reportAttributeAccessIssue]
    precision = "float64" if double else "float32"
    return ThreadPoolExecutor(count, initializer=lambda: in_precision(precision).__enter__())


def on_processor() -> AbstractContextManager[Any]:
    """What JAX does inside, it does on this machine's processor: thousands of small things, slow on a GPU."""
    try:
        return jax.default_device(jax.devices("cpu")[0])
    except RuntimeError:  # JAX_PLATFORMS leaves it out
        return nullcontext()
