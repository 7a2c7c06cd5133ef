"""Strict arithmetic for every test: double precision outside of runs, no silent promotion of types."""

from undertow.process import prepare  # isort: skip  (before JAX is imported

prepare()

import os

import jax
import pytest

jax.config.update("jax_numpy_dtype_promotion", "strict")


def pytest_configure(config):
    """Quick tests compile far longer than they run: XLA need not try hard, unless XLA_FLAGS says so. It halves the time."""
    flags, slow = os.environ.get("XLA_FLAGS", ""), config.getoption("-m") == "slow"
    if "xla_backend_optimization_level" in flags or slow:
        return
    flags += " --xla_backend_optimization_level=0"
    if jax.__version_info__ < (0, 11):  # later ones know no other emitters, and stop at a flag that they do not know
        flags += " --xla_cpu_use_fusion_emitters=false"
    os.environ["XLA_FLAGS"] = flags.strip()


@pytest.fixture
def key():
    return jax.random.PRNGKey(20261121)
