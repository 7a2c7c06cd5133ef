"""Strict arithmetic for every test: double precision outside of runs, no silent promotion of types or ranks."""

from undertow.process_setup import prepare  # isort: skip  (before JAX is imported

prepare()

import os

import jax
import jaxtyping
import pytest
from jaxtyping import install_import_hook

jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# Annotations of arrays are checked at every call of the rooms that compute. `process` comes before JAX; the models of
# `scenario` and the commands of `cli` are checked by pydantic and typer.
CHECKED = (
    "numerics",
    "core",
    "sensors",
    "vehicles",
    "thrusters",
    "power",
    "disturbances",
    "references",
    "navigation",
    "estimation",
    "plants",
    "controllers",
    "supervision",
    "loop",
    "analysis",
)
# Folders of tests where they are: together they trace every part and both loops. Elsewhere the same code runs again, and
# checking it once more would cost time and find nothing. Arrays of different rank are an error everywhere.
STRICT = ("numerics", "physics", "conformance")
install_import_hook([f"undertow.{room}" for room in CHECKED], "beartype.beartype")
jaxtyping.config.update("jaxtyping_disable", True)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Before the fixtures of the test are made."""
    jaxtyping.config.update("jaxtyping_disable", item.path.parent.name not in STRICT)


def pytest_configure(config):
    """Quick tests compile far longer than they run: XLA need not try hard, unless XLA_FLAGS says so. It halves the time."""
    flags, slow = os.environ.get("XLA_FLAGS", ""), config.getoption("-m") == "slow"
    if "xla_backend_optimization_level" in flags or slow:
        return
    flags += " --xla_backend_optimization_level=0"
    if jax.__version_info__ < (0, 11):  # later ones know no other emitters, and stop at a flag that they do not know
        flags += " --xla_cpu_use_fusion_emitters=false --xla_cpu_parallel_codegen_split_count=1"  # both cores are busy
    os.environ["XLA_FLAGS"] = flags.strip()


@pytest.fixture
def key():
    return jax.random.PRNGKey(20261121)
