"""Candidates by name, file and options, and the line that says how each was tuned."""

import json
from functools import partial
from pathlib import Path

import pytest

from undertow.control.controllers import adrc, pid, rcaf, super_twisting
from undertow.core.errors import BadInput
from undertow.physics.plants import double_integrator
from undertow.scenario.reading import dump, read
from undertow.studies.comparison.candidates import controllers
from undertow.studies.comparison.prepare import prepare_comparison
from undertow.studies.comparison.tuning_note import tuning_note

DT = 0.02


def of(entry, path):
    """The first of two controllers."""
    return controllers([entry, "pid"], read(Path(path)), Path(path))[0]


@pytest.mark.parametrize(
    ("entry", "name", "controller"),
    [
        ("robust", "robust", {"kind": "rcaf", "preset": "robust"}),
        ("adrc", "adrc", {"kind": "adrc"}),
        ("mine=indi", "mine", {"kind": "indi"}),
        ("scenario", "pid (scenario)", {"kind": "pid", "frequency": 2.0}),
        ("folder/other.yaml", "law (other)", {"kind": "folder/law.py:law", "gain": 3}),
        ("folder/law.py:law", "law", {"kind": "folder/law.py:law"}),
    ],
)
def test_entries(entry, name, controller, scenario, tmp_path):
    """Names of files are relative to the current folder, and those in a file to its folder."""
    path = scenario()
    Path("folder").mkdir()
    Path("folder/law.py").write_text("def law(model, gain=1.0):\n    return None\n")
    Path("folder/other.yaml").write_text(
        dump({"controller": {"kind": "./law.py:law", "gain": 3}, "reference": "circle"})
    )
    if ".py" in controller["kind"]:
        controller = controller | {"kind": f"{tmp_path}/{controller['kind']}"}
    found = of(entry, path)
    assert (found.name, found.changes) == (name, {"controller": controller})
    assert found.source == {"scenario": Path(path), "folder/other.yaml": Path(entry)}.get(entry)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["pid"], "at least two controllers"),
        (["pid", "pdi"], "Did you mean `pid`?"),
        (["pid", "mine.py"], "Name the function as well: mine.py:FUNCTION"),
        (["pid", "missing.yaml"], "be an existing file"),
        (["pid", ""], "name controllers, separated by commas"),
        ({"a": "pid", "b": 3}, "name controllers"),
    ],
)
def test_bad_entries(given, said, scenario):
    with pytest.raises(BadInput, match="--controllers") as found:
        prepare_comparison([Path(scenario())], given)
    assert said in str(found.value)


def test_equal_names_get_numbers(scenario):
    path = Path(scenario())
    names = [one.name for one in controllers(["pid", "pid", "adrc", "pid"], read(path), path)]
    assert names == ["pid", "pid 2", "adrc", "pid 3"]


def note(part, law, source=None):
    return tuning_note(part, law(double_integrator(1).model()), DT, Path(), source)


@pytest.mark.full
def test_how_gains_came_about():
    by_rule = note({"kind": "pid"}, pid)
    assert by_rule.tuned and by_rule.sentence == "gains from the rule of `controllers/bandwidths.py`"
    assert "with damping 2.0 given" in note({"kind": "pid", "damping": 2.0}, pid).sentence
    assert note({"kind": "pid", "damping": 1.0, "frequency": None}, pid) == by_rule  # the default values
    assert note({"kind": "super_twisting"}, super_twisting) == by_rule
    assert "given" in note({"kind": "super_twisting", "slope": 2.0}, super_twisting).sentence
    given = note({"kind": "pid", "frequency": 2.0}, pid, Path("a.yaml"))
    assert given == ("gains given in a.yaml (frequency 2.0), not tuned by `undertow tune`", False)
    assert note({"kind": "adrc"}, adrc) == by_rule
    assert note({"kind": "adrc", "bandwidth": 20.0}, adrc).sentence.startswith("gains given (bandwidth 20.0)")
    paper = note({"kind": "rcaf", "preset": "paper"}, partial(rcaf, preset="paper"))
    assert not paper.tuned and "Table 1" in paper.sentence


@pytest.mark.full
def test_tuned_gains_are_those_of_the_file_beside(tmp_path):
    """Changed by hand since, they are not."""
    costs = {"given": {"held_out_cost": 3.0}, "tuned": {"held_out_cost": 1.5, "options": {"frequency": [2.5]}}}
    data = {"method": "gradient", "evaluations": 40, "elapsed": 12.3, "finished": True, "gains": costs, "kept": "tuned"}
    (tmp_path / "tuning.json").write_text(json.dumps(data))
    found = note({"kind": "pid", "frequency": [2.5]}, pid, tmp_path / "tuned.yaml")
    assert found.tuned
    assert found.sentence == (
        "tuned by `undertow tune` (gradient, 40 evaluations in 12 s; held-out cost 1.5, 2 times smaller than with the "
        "gains before)"
    )
    changed = note({"kind": "pid", "frequency": [2.6]}, pid, tmp_path / "tuned.yaml")
    assert not changed.tuned and "gains given in" in changed.sentence
    costs["given"]["options"] = {"frequency": [2.0]}
    (tmp_path / "tuning.json").write_text(json.dumps(data | {"kept": "given"}))
    kept = note({"kind": "pid", "frequency": [2.0]}, pid, tmp_path / "tuned.yaml")
    assert kept.tuned and "held-out cost 3, the gains before, which no others" in kept.sentence
    (tmp_path / "tuning.json").write_text("{")
    assert not note({"kind": "pid", "frequency": [2.5]}, pid, tmp_path / "tuned.yaml").tuned
