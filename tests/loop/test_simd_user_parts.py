"""Parts as users write them: compiled into lanes, or left to XLA with a reason, and the same figures either way."""

from pathlib import Path

import jax
import numpy as np
import pytest

from undertow.scenario.results.run_scenario import run_scenario

FILE = Path(__file__).with_name("user_parts.py")

PARTS = {
    "kalman": {"navigation": {"kind": f"{FILE}:kalman"}},
    "network": {"navigation": {"kind": f"{FILE}:network"}},
    "predictive": {"controller": {"kind": f"{FILE}:predictive"}},
    **{
        by: {"disturbance": {"kind": f"{FILE}:pushed", "by": by}}
        for by in ("table", "ordered", "spectrum", "chosen", "of_bytes", "by_python", "drawn", "field")
    },
}

# What is left to XLA, and why.
LEFT = {
    "spectrum": "numbers of type complex128",
    "of_bytes": "numbers of type int8",
    "by_python": "no rule for `pure_callback`",
    "field": "XLA takes less time by estimate",
}


def scenario(name, backend):
    return {
        "plant": "inverted_pendulum",
        "controller": {"kind": "pid", "frequency": 4.0},
        "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
        "initial": {"position": [0.05]},
        "loop": {"duration": 0.3, "dt": 1e-3, "record": 1e-2, "backend": backend},
        **PARTS[name],
    }


# Each compiles a loop twice; the operations themselves are those of simdjit/tests/test_primitives.
SLOW = ("network", "table", "ordered", "chosen", "of_bytes", "by_python", "predictive", "spectrum", "kalman")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else pytest.mark.full) for name in PARTS]
)
def test_the_same_figures_and_the_reason_where_it_is_left_to_xla(name):
    with jax.numpy_dtype_promotion("standard"):  # users are not as strict as these tests
        found, wanted = (run_scenario(scenario(name, backend)).dataset for backend in ("simd", "xla"))
    why = found.attrs.get("left_to_xla")
    assert why == LEFT.get(name) or (name == "field" and why.startswith(f"{LEFT[name]}: "))
    assert "left_to_xla" not in wanted.attrs
    for signal in ("position", "velocity", "input"):
        here, there = found[signal].values, wanted[signal].values
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-9 * np.abs(there).max(), err_msg=signal)
    assert np.ptp(found["input"].values) > 0
