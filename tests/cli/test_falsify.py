"""`undertow falsify`: result files, the counter-example, bad input."""

import json

import pytest
from ruamel.yaml import YAML

pytestmark = pytest.mark.full

SCENARIO = """\
plant: {kind: double_integrator, axes: 1, limit: 20}
controller: {kind: pid, frequency: 2}
reference: {kind: setpoint, position: [1]}
disturbance: {kind: sinusoid, amplitude: 0.2}
loop: {duration: 8, dt: 0.02, record: 0.02}
requirements:
  settles: {formula: "within 4 s always abs(error) < 0.3"}
  position_rms: {below: 0.4}
falsify: {vary: {disturbance.amplitude: {between: [0, 2]}}}
"""


def test_the_counterexample_repeats_the_failure(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    said = undertow("falsify", "s.yaml", "--method", "search", "--budget", "150", "--out", "out")
    assert said.code == 0, said
    assert "repeats this bit for bit: undertow simulate" in said.out
    folder = tmp_path / "out"
    assert sorted(path.name for path in folder.iterdir()) == ["counterexample.yaml", "falsify.json", "figures"]
    found = json.loads((folder / "falsify.json").read_text())["counterexample"]
    text = (folder / "counterexample.yaml").read_text()
    assert text.startswith("# Counter-example of s.yaml: violates settles")
    assert YAML(typ="safe").load(text)["disturbance"]["amplitude"] == found["values"]["disturbance.amplitude"]
    again = undertow("simulate", "out/counterexample.yaml", "--out", "again")
    assert again.code == 0 and "Requirement settles is violated" in again.out
    judged = json.loads((tmp_path / "again" / "metrics.json").read_text())["requirements"]
    assert {name: one["robustness"] for name, one in judged.items()} == found["robustness"]
    assert [one["holds"] for one in judged.values()] == [False, True]
    earlier = undertow("falsify", "s.yaml", "--out", "out")
    assert earlier.code == 2 and "earlier result" in earlier.err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{between: [0, 2]}", "{between: [2, 0]}", "must have low below high"),
        ("{between: [0, 2]}", "[0, 2]", "must be bounds, such as {between: [0, 2]}"),
        ("{between: [0, 2]}", "{between: [1, 2]}", "must be around the nominal value 0.2, but is 1 to 2"),
        ("{vary: {disturbance.amplitude: {between: [0, 2]}}}", "{}", "`falsify.vary` must name what varies"),
        ("disturbance.amplitude: {", "disturbance.amplitud: {", "must have a number for its nominal value"),
        ("disturbance.amplitude: {", "seed: {", "must be the key path of a number in plant, model, controller"),
        ("abs(error) < 0.3", "abs(eror) < 0.3", "`eror` (s.yaml, line 7). Did you mean `error`?"),
        ("within 4 s", "always[9, 10]", "must begin before the end of the run (8 s), but is 9 s"),
        ("position_rms", "position_rm", "must be a metric of this plant, or have a `formula`"),
        ("{below: 0.4}", "{below: 0.4, formula: a}", "must have one of below, formula"),
        ("{below: 0.4}", "0.4", "`requirements.position_rms` must be a mapping of keys to values, but is 0.4"),
        ("< 0.3", "< 0.03", "`requirements.settles` must hold in the nominal scenario, but is violated"),
        ("falsify: {", "falsify: {requirements: [settle], ", "must name requirements of the scenario, but is settle"),
        ("disturbance: {", "navigation: {kind: degraded}\nmetrics: []\ndisturbnce: {", "must be a key of the scenario"),
    ],
)
def test_bad_scenarios(refused, tmp_path, old, new, said):
    assert old in SCENARIO
    (tmp_path / "s.yaml").write_text(SCENARIO.replace(old, new))
    assert said in refused("falsify", "s.yaml")


def test_a_continuous_loop(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(
        SCENARIO.replace("{kind: pid, frequency: 2}", "{kind: rcaf, preset: paper}").replace(
            "dt: 0.02, record", "kind: continuous, record"
        )
    )
    assert "`loop.kind` must be sampled for `undertow falsify`, but is continuous" in refused("falsify", "s.yaml")


def interrupted(*arguments):
    raise KeyboardInterrupt


def test_interrupted_and_resumed(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    command = ("falsify", "s.yaml", "--method", "search", "--budget", "60", "--out")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("undertow.studies.falsification.falsify.shrink", interrupted)
        said = undertow(*command, "out")
    assert said.code == 130 and "--resume" in said.err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["falsify.jsonl"]
    assert undertow(*command, "out").code == 2
    assert undertow(*command, "out", "--resume").code == 0
    assert undertow(*command, "whole").code == 0
    names = ("falsify.json", "counterexample.yaml")
    assert all((tmp_path / "out" / name).read_text() == (tmp_path / "whole" / name).read_text() for name in names)


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--budget", "0"), "`--budget` must be at least 1 run"),
        (("--seed", "-1"), "`--seed` must be between 0 and 2^32 - 1"),
        (("--method", "guess"), "`--method` must be"),
        (("--resume",), "must find an unfinished falsification"),
    ],
)
def test_bad_options(refused, tmp_path, option, said):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    assert said in refused("falsify", "s.yaml", "--out", "out", *option)
