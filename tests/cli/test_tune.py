"""`undertow tune`: result files, resuming, bad input."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from messages import named
from ruamel.yaml import YAML

from undertow.core.metric import Metric
from undertow.report.answers.tuning_answer import answer_of_tuning
from undertow.studies.tuning.cost import Shares
from undertow.studies.tuning.stability import Certificate
from undertow.studies.tuning.tune import Evaluated, Tuned

pytestmark = pytest.mark.full

SCENARIO = """\
plant: {kind: double_integrator, axes: 1, limit: 20}
controller: {kind: pid, frequency: 2}
reference: {kind: setpoint, position: [0]}
disturbance: {kind: sinusoid, amplitude: 1}
loop: {duration: 4, dt: 0.02, record: 0.1}
tune: {parameters: {frequency: [0.5, 8]}, iterations: 3, train: {seeds: 1}, held_out: {seeds: 2}}
"""


@pytest.mark.slow
def test_interrupted_and_resumed_its_result_can_be_flown(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("undertow.studies.tuning.tune.search", interrupted)
        said = undertow("tune", "s.yaml", "--out", "out")
    assert said.code == 130 and "--resume" in said.err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["tuning.jsonl"]
    assert undertow("tune", "s.yaml", "--out", "out").code == 2
    said = undertow("tune", "s.yaml", "--out", "out", "--budget", "600", "--resume")
    assert said.code == 0, said
    assert "The held-out cost is" in said.out
    found = json.loads((tmp_path / "out" / "tuning.json").read_text())
    costs = [step["cost"] for step in found["history"]]
    assert costs == sorted(costs, reverse=True) and all(step["radius"] < 1 for step in found["history"])
    given, tuned = found["gains"]["given"], found["gains"]["tuned"]
    assert tuned["held_out_cost"] < given["held_out_cost"] and max(tuned["spectral_radii"]) < 1
    assert len(tuned["held_out"]["tracking"]) == 2
    text = (tmp_path / "out" / "tuned.yaml").read_text()
    assert text.startswith("# Gains found by `undertow tune`") and "spectral radius" in text
    assert YAML(typ="safe").load(text)["controller"]["frequency"] == tuned["options"]["frequency"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["figures", "tuned.yaml", "tuning.json"]
    assert undertow("simulate", "out/tuned.yaml", "--out", "flown").code == 0
    again = undertow("tune", "s.yaml", "--out", "out")
    assert again.code == 2 and "earlier result" in again.err


def interrupted(*arguments):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "{frequency: [0.5, 8]}",
            "{frequncy: [0.5, 8]}",
            "`tune.parameters.frequncy` must be an option of the controller, but is unknown (s.yaml, line 6). "
            "Did you mean `frequency`?",
        ),
        (
            "[0.5, 8]",
            "[8, 0.5]",
            "`tune.parameters.frequency` must be [low, high] with low < high, but is [8.0, 0.5] (s.yaml, line 6)",
        ),
        (
            "seeds: 1",
            "sets: [wu2018]",
            "`tune.train.sets` must be left out: there is only one parameter set, but is ['wu2018'] (s.yaml, line 6)",
        ),
        (
            "iterations: 3",
            "itertions: 3",
            "`tune.itertions` must be a key of the scenario, but is unknown (s.yaml, line 6). Did you mean `iterations`?",
        ),
        (
            "iterations: 3",
            "start: 5",
            "`tune.start` must be earlier than the end of a run (4 s), but is 5 s (s.yaml, line 6)",
        ),
    ],
)
def test_mistake_is_one_line(refused, tmp_path, old, new, said):
    assert old in SCENARIO
    (tmp_path / "s.yaml").write_text(SCENARIO.replace(old, new, 1))
    assert named(refused("tune", "s.yaml", "--out", "out")) == named(said)


def test_wrong_options(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    assert (
        refused("tune", "s.yaml", "--method", "luck")
        == "`--method` must be one of gradient, search, evolution, but is luck"
    )
    assert refused("tune", "s.yaml", "--budget", "0") == "`--budget` must be positive, but is 0 s"
    assert (
        refused("tune", "s.yaml", "--out", "out", "--resume")
        == "`--resume` must find an unfinished tuning, but is nothing in out. Leave --resume out to start one"
    )


def test_a_budget_that_ends_while_compiling_tunes_nothing(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    said = refused("tune", "s.yaml", "--out", "out", "--budget", "1e-3")
    assert said.startswith("`--budget` must suffice for compiling the runs")
    assert "Nothing was tuned" in said and not (tmp_path / "out").exists()


def evaluated(name, cost, radius=0.9, position=1.0, **options):
    parts = Shares(*(np.array([cost]) for _ in Shares._fields))._replace(position=np.array([position]))
    return Evaluated(name, options or None, parts, parts, cost, cost, Certificate((radius,), ("",)))


def tuning(given, tuned, **limits):
    metrics = {"position_rms": Metric("m", "", name="position error, rms per axis")}
    built = SimpleNamespace(criterion=lambda: limits, known_metrics=lambda: metrics)
    problem = SimpleNamespace(train=SimpleNamespace(variants=("",)), built=built)  # one vehicle
    return Tuned(problem, "search", (given, tuned, tuned), [], 40, 3, 12.0, True, 28)


def test_given_gains_are_kept_where_no_others_are_better():
    found = tuning(evaluated("given", 0.1325), evaluated("tuned", 0.134, frequency=2.8627))
    assert found.kept.name == "given"
    good, verdict, lines = answer_of_tuning(found, Path("out"))
    assert good is None
    assert verdict == (
        "The given gains are kept. Others were found, but on held-out runs their cost is 1.01 times larger than with the "
        "given ones."
    )
    assert lines[0] == "Best gains found: frequency 2.8627."
    assert "40 evaluations, 3 rejected without a certificate, 12 s; the search has converged." in lines


def test_given_gains_are_kept_where_better_ones_break_a_limit():
    """The cost trades errors of position for others; the limits of the scenario are not for trade."""
    found = tuning(
        evaluated("given", 0.2, position=0.007),
        evaluated("tuned", 0.1, position=0.051, frequency=2.0),
        position_rms=0.05,
    )
    answer = answer_of_tuning(found, Path("out"))
    assert found.kept.name == "given" and answer.verdict.endswith("but they break a limit.")
    assert answer.lines[0] == "Position error, rms per axis on held-out runs: 7 mm before, 5.1 cm after (limit 5 cm)."
    within = tuning(
        evaluated("given", 0.2, position=0.06),
        evaluated("tuned", 0.1, position=0.051, frequency=2.0),
        position_rms=0.05,
    )
    assert within.kept.name == "tuned"  # nothing is broken that was kept


def test_a_ratio_is_said_in_its_direction():
    better = tuning(evaluated("given", 0.2), evaluated("tuned", 0.1, frequency=2.0))
    assert better.kept.name == "tuned"
    answer = answer_of_tuning(better, Path("out"))
    assert answer.good and "their cost is 2 times smaller than with the given gains." in answer.verdict
    assert answer.lines[-1] == "Next: undertow simulate out/tuned.yaml"
    unstable = tuning(evaluated("given", 0.1, radius=1.1), evaluated("tuned", 0.15, frequency=2.0))
    assert unstable.kept.name == "tuned"
    answer = answer_of_tuning(unstable, Path("out"))
    assert "1.5 times larger than with the given gains." in answer.verdict
    assert "The given gains have no certificate of stability." in answer.lines


def test_an_interrupt_before_the_first_answer_promises_nothing(undertow, tmp_path, monkeypatch):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    monkeypatch.setattr("undertow.studies.tuning.evaluator.Evaluation.costs", interrupted)
    said = undertow("tune", "s.yaml", "--out", "out")
    assert said.code == 130 and said.err == "No results were written to out.\n"
    assert [path.name for path in tmp_path.iterdir()] == ["s.yaml"]


@pytest.mark.parametrize("content", ["junk\n", '{"about": 1}\n[]\n', "\udcff\n"])
def test_a_journal_that_cannot_be_read(refused, tmp_path, content):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "tuning.jsonl").write_bytes(content.encode("utf-8", "surrogateescape"))
    assert refused("tune", "s.yaml", "--out", "out", "--resume").startswith(
        "`--resume` must find a checkpoint that can be"
    )
