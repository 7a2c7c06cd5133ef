"""Tuning with equal budgets: what is spent, what is found, what it is judged on, and what a resumed tuning gives."""

import json
from pathlib import Path

import pytest

import undertow as ut
from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.reading import from_data, read
from undertow.studies.campaign.campaign_schema import Campaign
from undertow.studies.campaign.trials import trials
from undertow.studies.comparison import equal_budgets as budgets
from undertow.studies.comparison.candidates import controllers, scenario_with
from undertow.studies.comparison.equal_budgets import EqualBudgets, Runs, TunedLaw, check_budget, equal_budgets
from undertow.studies.comparison.held_out import SET, held_out
from undertow.studies.tuning.evaluator import Evaluation

BUDGET = 20
OPTIONAL = "def law(model, frequency=1.0):\n    return pid(model, frequency={})\n"
FIXED = "def fixed(model):\n    from undertow.control.controllers import pid\n    return pid(model, frequency=2.0)\n"


@pytest.fixture
def tuned(scenario):
    """Two laws that were tuned, and one that was not: its function has no options."""
    path = Path(scenario())
    Path("mine.py").write_text(FIXED)
    text, said = read(path), []
    found = controllers(["pid", "adrc", "./mine.py:fixed"], text, path)
    return found, *equal_budgets(found, text, BUDGET, Path("kept"), said.append)


@pytest.mark.full
def test_budgets_are_equal_and_no_law_gets_worse(tuned, monkeypatch):
    before, after, found = tuned
    pid, adrc, fixed = found.laws
    assert [law.evaluations for law in found.laws] == [BUDGET, BUDGET, 0]
    assert (pid.parameters, adrc.parameters) == (3, 3)
    for law in (pid, adrc):
        assert law.train is not None and law.train[1] < 0.9 * law.train[0]
        assert law.radius is not None and law.radius < 1
        assert f"{BUDGET} evaluations of 3 numbers" in law.sentence
    assert fixed.train is None and "judged as it is" in fixed.sentence
    assert after[2].changes == before[2].changes
    frequency = after[0].changes["controller"]["frequency"]
    assert frequency == pid.gains["frequency"] != 2.0 and 0.1 <= frequency[0] <= 12.5
    assert found.train == Runs(2, (0.6, 1.2), (), 2) and found.held_out == Runs(4, (0.6, 1.2), (), 4)

    # A finished tuning is not repeated.
    monkeypatch.setattr(budgets, "tune", None)
    again = equal_budgets(before, read(Path("axis.yaml")), BUDGET, Path("kept"))
    assert again == (after, found)
    with pytest.raises(BadInput, match="continue with the same scenario, budget and versions"):
        equal_budgets(before, read(Path("axis.yaml")), BUDGET + 1, Path("kept"))


@pytest.mark.full
def test_resumed_command_leaves_the_same_bytes(scenario, monkeypatch, capsys):
    """Stopped in the search of the second law: its evaluations are kept, and the first law is not tuned again."""
    path, costs, asked = scenario(), Evaluation.costs, []
    given = ["compare", path, "--controllers", "pid,adrc", "--trials", "6", "--tune", str(BUDGET)]
    assert run([*given, "--out", "whole"]) == 0

    def stopped(self, points):
        asked.append(len(points))
        if sum(asked) > BUDGET + 12:
            raise KeyboardInterrupt
        return costs(self, points)

    with monkeypatch.context() as patched:
        patched.setattr(Evaluation, "costs", stopped)
        assert run([*given, "--out", "parts"]) == 130
    assert sorted(one.name for one in Path("parts/tuning").iterdir()) == ["1-pid.json", "2-adrc.jsonl"]
    again = (
        f"To continue: undertow compare {path} --controllers pid,adrc --trials 6 --tune {BUDGET} --out parts --resume"
    )
    assert again in capsys.readouterr().err
    assert run([*given, "--out", "parts"]) == 2
    assert "Add --resume to continue it" in capsys.readouterr().err
    assert run([*given, "--out", "parts", "--resume"]) == 0
    for name in ("comparison.json", "comparison.csv", "comparison.md", "comparison.tex", "scenarios/2-adrc.yaml"):
        assert Path("parts", name).read_bytes() == Path("whole", name).read_bytes(), name
    for name in ("1-pid.json", "2-adrc.json"):
        assert Path("parts/tuning", name).read_bytes() == Path("whole/tuning", name).read_bytes()
    found = json.loads(Path("whole/comparison.json").read_text())["budgets"]
    assert [law["evaluations"] for law in found["laws"]] == [BUDGET, BUDGET]
    page = Path("whole/comparison.html").read_text()
    assert "spectral radius" in page and "computing time per step" in page
    assert json.loads(Path("whole/step_times.json").read_text())["pid"]["median"] > 0


@pytest.mark.slow
def test_from_python_tuned_gains_lower_the_error(scenario):
    with pytest.warns(UserWarning, match="not tuned"):
        before = ut.compare(scenario(), {"slow": {"kind": "pid", "frequency": 1}, "adrc": "adrc"}, trials=6)
    after = ut.compare("axis.yaml", {"slow": {"kind": "pid", "frequency": 1}, "adrc": "adrc"}, trials=6, tune=BUDGET)
    errors = [one.dataset["position_rms"].sel(controller="slow").values for one in (before, after)]
    assert (errors[1] < 0.5 * errors[0]).all()


@pytest.mark.full
def test_trials_are_held_out():
    """Sets that were not trained on, with the scenario's own vehicle as the nominal model; waves of other heights."""
    data = {
        "plant": {"kind": "hybrid_vehicle", "vehicle": "bluerov2_heavy"},
        "controller": "pid",
        "reference": {"kind": "setpoint", "position": [0.0] * 6},
        "disturbance": [{"kind": "current", "velocity": [0.1, 0, 0]}, {"kind": "waves", "height": 0.5}],
        "loop": {"duration": 1.0, "dt": 0.02, "record": 0.1},
    }
    base = from_data(data)
    runs = Runs(4, (0.6, 1.2), ("vonbenzon2022", "wu2018"), 8)
    law = TunedLaw("pid", {}, "", 3, BUDGET, (2.0, 1.0), (2.0, 1.0), 0.9)
    text = held_out(base, base, EqualBudgets(BUDGET, (law,), runs, runs))
    assert text.data["vary"] == {
        SET: {"choice": ["vonbenzon2022", "wu2018"]},
        "disturbance[1].height": {"uniform": [pytest.approx(0.3), pytest.approx(0.6)]},
    }
    several = trials(Campaign.model_validate({"trials": 4} | text.data), text)
    known = [build(from_data(several.data(row))) for row in range(4)]
    assert {one.resolved["model"]["plant"]["vehicle"]["parameters"] for one in known} == {"vonbenzon2022"}
    assert {one.resolved["plant"]["vehicle"]["parameters"] for one in known} == {"vonbenzon2022", "wu2018"}
    asked = base._replace(data={"scenario": data, "vary": {"disturbance[1].height": {"uniform": [1.0, 2.0]}}})
    text = held_out(asked, base, EqualBudgets(BUDGET, (law,), runs, runs))
    assert text.data["vary"]["disturbance[1].height"] == {"uniform": [1.0, 2.0]} and SET in text.data["vary"]
    assert held_out(base, base, EqualBudgets(BUDGET, (), None, None)) == base


@pytest.mark.full
def test_parameters_hold_for_the_scenarios_own_controller(scenario, capsys):
    """Its function is traced with arrays; one that is not made for that says so."""
    Path("mine.py").write_text("from undertow.control.controllers import pid\n\n" + OPTIONAL.format("frequency"))
    own = {"controller": {"kind": "mine.py:law", "frequency": 2.0}, "tune": {"parameters": {"frequency": [0.5, 8.0]}}}
    path = Path(scenario(**own))
    found = controllers(["scenario", "pid"], read(path), path)
    asked = [scenario_with(one, read(path)).data["tune"] for one in found]
    assert asked == [{"parameters": {"frequency": [0.5, 8.0]}}, {}]
    Path("mine.py").write_text("from undertow.control.controllers import pid\n\n" + OPTIONAL.format("float(frequency)"))
    assert run(["compare", str(path), "--controllers", "scenario,pid", "--tune", "20", "--out", "out"]) == 2
    assert "takes as arrays of JAX, one number for each axis" in capsys.readouterr().err
    assert not Path("out").exists()


def test_bad_budgets(scenario, capsys):
    with pytest.raises(BadInput, match="`--tune` must be at least 12 evaluations, the initial design, but is 3"):
        check_budget(3)
    path = scenario()
    assert run(["compare", path, "--controllers", "pid,adrc", "--tune", "3", "--out", "out"]) == 2
    assert run(["compare", path, scenario("b"), "--tune", "20", "--out", "out"]) == 2
    assert "`--tune` must be given with --controllers" in capsys.readouterr().err
    assert not Path("out").exists()
