"""Strict arithmetic and quick compilation for all tests; a function in lanes, to be compared with the same one by JAX."""

import os

import jax
import numpy as np
import pytest

from simdjit import Loop

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")


def pytest_configure(config):
    """Tests compile far longer than they run: compilers need not try hard, unless XLA_FLAGS is set or slow tests run alone."""
    if "XLA_FLAGS" not in os.environ and config.getoption("-m") != "slow":
        os.environ["XLA_FLAGS"] = "--xla_backend_optimization_level=0"
        os.environ.setdefault("SIMDJIT_OPTIMIZATION", "0")


def pytest_collection_modifyitems(items, config):
    """A slow test runs only where `-m` names its mark, not with the rest of its file."""
    if "slow" not in config.getoption("-m"):
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("slow")])
        items[:] = [item for item in items if not item.get_closest_marker("slow")]


@pytest.fixture
def in_lanes():
    """`in_lanes(f)(x, ...)`: f of each row of arrays, in lanes; `constant` says which arguments are constants."""

    def compiled(function, constant=(), lanes=0):
        def run(*rows):
            example = tuple(jax.numpy.asarray(row[0]) for row in rows)
            fixed = [i in constant for i in range(len(rows))]
            program = Loop.recording(function, example, fixed, lanes)
            _, recorded = program.run(tuple(map(np.asarray, rows)), steps=1, every=1)
            return jax.tree.map(lambda leaf: leaf[:, 0], recorded)

        return run

    return compiled
