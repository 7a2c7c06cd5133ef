"""Which tests run, how their programs are compiled, and strict arithmetic for all of them.

A test without a mark belongs to the quick set, which `pytest` runs. Every other one says in a mark of its own or of its
file (`pytestmark`) what it belongs to; pyproject.toml lists the marks.
"""

import gc
import os
import re
import threading

from undertow.core.process_setup import prepare  # isort: skip  (before JAX is imported

GIVEN_XLA_FLAGS = os.environ.get("XLA_FLAGS", "")
prepare()

import jax
import jaxtyping
import pytest
from jax._src.interpreters import mlir
from jaxtyping import install_import_hook

jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# What JAX traces it keeps: to look for garbage after every 700 new objects, as Python does by default, takes a tenth of
# the quick set and finds little.
gc.set_threshold(50_000)

# Parts of the full set; those of the second line need other programs, or minutes.
IN_THE_FULL_SET = {"full", "docs", "compiler", "interop", "soak"}
BY_THEMSELVES = {"slow", "slurm", "ssh", "dds"}
MARK_OF_A_FILE = re.compile(r"^pytestmark = pytest\.mark\.(\w+)$", re.MULTILINE)

# Annotations of arrays are checked at every call of the rooms that compute. `process` comes before JAX; the models of
# `scenario` and the commands of `cli` are checked by pydantic and typer.
CHECKED = (
    "core",
    "physics.sensors",
    "physics.vehicles",
    "physics.thrusters",
    "physics.power",
    "physics.disturbances",
    "physics.plants",
    "control",
    "simulation.loop",
    "analysis",
)
# Folders of tests where they are: together they trace every part and both loops. Elsewhere the same code runs again, and
# checking it once more would cost time and find nothing. Arrays of different rank are an error everywhere.
STRICT = ("numerics", "physics", "conformance")
jaxtyping.config.update("jaxtyping_disable", True)


def pytest_addoption(pluginmanager):
    """Annotations are checked in the full set: to prepare for it takes as long as a hundred quick tests.

    Of all hooks only this one comes before the `conftest.py` of a folder is imported, which imports what is checked.
    """
    expression = pluginmanager.get_plugin("pytestconfig").known_args_namespace.markexpr
    if "full" in expression:
        install_import_hook([f"undertow.{room}" for room in CHECKED], "beartype.beartype")


def pytest_configure(config):
    if config.getoption("-m") != "slow":
        compile_quickly()
    share_lowering_context()


def compile_quickly():
    """Tests compile far longer than they run: LLVM need not try hard, unless XLA_FLAGS says so. It takes a fifth of the time."""
    if "xla_backend_optimization_level" in GIVEN_XLA_FLAGS:
        return
    flags = os.environ["XLA_FLAGS"] + " --xla_backend_optimization_level=0"  # of two, the last counts
    if jax.__version_info__ < (0, 11):  # later ones stop at a flag that they do not know
        flags += " --xla_cpu_parallel_codegen_split_count=1"  # both cores are busy
    os.environ["XLA_FLAGS"] = flags
    os.environ.setdefault("SIMDJIT_OPTIMIZATION", "0")


def share_lowering_context():
    """JAX lowers each program in an MLIR context of its own, most of the time of a small one; tests have thousands.

    One for each thread is enough, but for programs that are lowered while another one is. The function is JAX's own:
    where a version has none of that name, nothing is shared.
    """
    make, kept = getattr(mlir, "make_ir_context", None), threading.local()

    def context_of_this_thread():
        if mlir.ir.Context.current is not None:
            return make()
        if not hasattr(kept, "context"):
            kept.context = make()
        return kept.context

    if make:
        mlir.make_ir_context = context_of_this_thread


def pytest_ignore_collect(collection_path, config):
    """Files without a quick test are not even imported for the quick set: all of them take as long as its tests."""
    if config.getoption("-m") == "quick" and collection_path.suffix == ".py":
        mark = MARK_OF_A_FILE.search(collection_path.read_text(encoding="utf-8"))
        return True if mark and mark[1] in IN_THE_FULL_SET | BY_THEMSELVES else None
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items, config):
    """Every test is `quick`, or `full`, or by itself: then only an expression that names its mark has it run.

    So a slow test does not run with the rest of its file, whatever the mark of the file.
    """
    named = BY_THEMSELVES & set(re.findall(r"\w+", config.getoption("-m")))
    kept, left_out = [], []
    for item in items:
        marks = {mark.name for mark in item.iter_markers()}
        if not marks & BY_THEMSELVES:
            item.add_marker("full" if marks & IN_THE_FULL_SET else "quick")
        (kept if marks & BY_THEMSELVES <= named else left_out).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = kept


def pytest_unconfigure(config):
    """pytest looks for garbage five times before it ends, through all that JAX keeps: four seconds of the quick set."""
    if config.getoption("-m") == "quick":
        gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Before the fixtures of the test are made."""
    jaxtyping.config.update("jaxtyping_disable", item.path.parent.name not in STRICT)


@pytest.fixture
def key():
    return jax.random.PRNGKey(20261121)
