"""benchmarks/exported_code.py: an exported controller has the same bits on a Cortex-M4, with newlib, under QEMU."""

import importlib.util
from pathlib import Path

import pytest

pytestmark = pytest.mark.compiler

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def benchmark():
    spec = importlib.util.spec_from_file_location("exported_code", ROOT / "benchmarks" / "exported_code.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert not module.missing(), "This test needs gcc-arm-none-eabi, libnewlib-arm-none-eabi and qemu-system-arm"
    return module


@pytest.mark.slow
@pytest.mark.parametrize(
    "program", [("bluerov2_heavy", "controller"), ("bluerov2_heavy", "navigation"), ("paper_example2", "controller")]
)
def test_the_same_bits_on_a_cortex_m4(benchmark, program):
    for precision in ("float32", "float64"):
        small, fast = (benchmark.on_cortex_m4(*program, precision, level) for level in ("-Os", "-O2"))
        for found in (small, fast):
            assert (found["steps_that_differ"], found["steps"]) == (0, 50)
            assert 0 < found["stack_bytes"] < 8192 and 0 < found["instructions_mean"] <= found["instructions_most"]
        assert small["code_bytes"] < fast["code_bytes"]
