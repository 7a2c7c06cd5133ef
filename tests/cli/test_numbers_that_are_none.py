"""Runs whose numbers leave what floating point holds: a status, a table with dashes, and all files; no internal error."""

import jax
import pytest

from undertow.cli.tables import terminal_table, wide_console
from undertow.report.run_tables import certificate_rows
from undertow.scenario.results.run_facts import facts_from
from undertow.scenario.results.run_scenario import run_scenario

pytestmark = pytest.mark.full

BASE = {
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "ideal"}, "ledger": False},
    "controller": {"kind": "rcaf", "preset": "paper"},
    "reference": {"kind": "setpoint", "position": [0.0] * 6},
    "loop": {"duration": 0.05, "dt": 0.01, "record": 0.01},
}


@pytest.mark.parametrize(
    ("preset", "velocity", "precision"),
    [
        ("paper", 1e30, "float32"),
        pytest.param("robust", 1e200, "float64", marks=pytest.mark.slow),
        pytest.param("paper", 1e200, "float64", marks=pytest.mark.slow),
        pytest.param("robust", 1e30, "float32", marks=pytest.mark.slow),
    ],
)
def test_what_is_not_finite_is_a_dash(capsys, preset, velocity, precision):
    before = jax.config.jax_enable_x64
    try:
        initial = {"velocity": [velocity] + [0.0] * 5}
        done = run_scenario(BASE | {"controller": {"preset": preset}, "initial": initial, "precision": precision})
    finally:
        jax.config.update("jax_enable_x64", before)
    certificate = facts_from(done.dataset.attrs).certificate
    assert done.status.word == "command_not_finite"
    assert certificate is not None and certificate["start"] is None
    wide_console().print(terminal_table(certificate_rows(certificate, (0.025, 0.05))))
    assert ": - at the start" in capsys.readouterr().out


def test_bound_that_is_not_finite_is_a_dash(capsys):
    known = {"function": "V", "start": 1.0, "end": None, "rising": {"whole": 0.0, "steady": None}, "hypotheses": []}
    bound = {"estimation_bound": [1.0, None], "estimation_within": {"whole": 0.0, "steady": 0.0}}
    wide_console().print(terminal_table(certificate_rows(known | bound, (0.0, 1.0))))
    assert "(up to -) for 0 % of the steady window." in " ".join(capsys.readouterr().out.split())
