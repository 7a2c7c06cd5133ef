"""`undertow bench --users` measures the shipped examples; what it prints is in order."""

import json
from pathlib import Path

import pytest

from undertow.cli.main import run
from undertow.scenario.build import build
from undertow.scenario.reading import from_data, read
from undertow.studies.speed.waiting import CASES, waiting_times

pytestmark = pytest.mark.full

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("name", "example"),
    [
        pytest.param("heavy", "bluerov2_heavy", marks=pytest.mark.slow),
        ("example1", "paper_example1"),
        ("pendulum", "inverted_pendulum"),
    ],
)
def test_cases_are_the_examples_and_differ_in_one_section(name, example):
    def resolved(text):
        return {key: value for key, value in build(text).resolved.items() if key != "description"}

    case = CASES[name]
    assert resolved(from_data(case.scenario)) == resolved(read(EXAMPLES / f"{example}.yaml"))
    assert sum(case.scenario[key] != case.changed[key] for key in case.scenario) == 1


@pytest.mark.slow
def test_times_are_in_order():
    stages = []
    found = waiting_times(lambda what, share: stages.append(share), {"pendulum": CASES["pendulum"]}, ())
    assert stages == sorted(stages) and stages[-1] == 1.0
    for when in ("cold", "changed"):
        assert found["jax_start_s"] < found[f"pendulum_{when}_results_s"] < found[f"pendulum_{when}_files_s"]


def test_it_is_printed(monkeypatch, capsys):
    monkeypatch.setattr(
        "undertow.cli.bench.waiting_times", lambda watch: {"jax_start_s": 0.5, "heavy_cold_files_s": 6.0}
    )
    assert run(["bench", "--users", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"jax_start_s": 0.5, "heavy_cold_files_s": 6.0}
    assert run(["bench", "--users"]) == 0
    assert "heavy cold files" in (said := capsys.readouterr().out) and "12" in said
