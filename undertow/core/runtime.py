"""How JAX is set up for undertow: precision, device, and one compiled function per closed loop.

Imported first by `undertow.core`; must run before JAX touches a device to have its full effect.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import jax

# XLA compiles the body of a small `while` loop into one plain function instead of a list of kernels to be
# dispatched one by one. Its own limit (1 kB of loop state) is below a vehicle with its thrusters; with the limit
# raised, one step of the closed loop takes a quarter of the time.
_ONE_FUNCTION_PER_LOOP = "xla_cpu_small_while_loop_byte_threshold=100000000"


def configure() -> None:
    """Double precision unless JAX_ENABLE_X64 says otherwise; closed loops compiled whole."""
    if "JAX_ENABLE_X64" not in os.environ:
        jax.config.update("jax_enable_x64", True)
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} --xla_backend_extra_options={_ONE_FUNCTION_PER_LOOP}".strip()


def in_precision(precision: str) -> AbstractContextManager[Any]:
    """What JAX makes inside, in this thread, is float64 or float32; other threads, and what comes after, are not."""
    return jax.enable_x64(precision == "float64")


def workers(count: int) -> ThreadPoolExecutor:
    """Threads that compute in the precision of the one that asks for them."""
    double = jax.config.jax_enable_x64  # pyright: ignore[reportAttributeAccessIssue]
    return ThreadPoolExecutor(count, initializer=lambda: jax.enable_x64(double).__enter__())


def on_processor() -> AbstractContextManager[Any]:
    """What JAX does inside, it does on this machine's processor: thousands of small things, slow on a GPU."""
    try:
        return jax.default_device(jax.devices("cpu")[0])
    except RuntimeError:  # JAX_PLATFORMS leaves it out
        return nullcontext()


configure()
