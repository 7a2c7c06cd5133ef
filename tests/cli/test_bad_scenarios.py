"""Every mistake in a scenario file is one line that names the key, the value, what is allowed, and the place."""

import pytest
from good_scenario import SCENARIO

from undertow.scenario.reading import read

YAML = "`s.yaml` must be valid YAML, but is not:"

# (what is replaced, by what, what is said)
MISTAKES = {
    "misspelt option": (
        "position: [2, 3",
        "positon: [2, 3",
        "`reference.positon` must be an option here, but is unknown (s.yaml, line 7). Did you mean `position`?",
    ),
    "misspelt key": (
        "seed: 3",
        "sede: 3",
        "`sede` must be a key of the scenario, but is unknown (s.yaml, line 11). Did you mean `seed`?",
    ),
    "misspelt inner key": (
        "duration: 0.1",
        "duratoin: 0.1",
        "`loop.duratoin` must be a key of the scenario, but is unknown (s.yaml, line 9). Did you mean `duration`?",
    ),
    "misspelt parameter": (
        "mass: 125",
        "mas: 125",
        "`plant.vehicle.mas` must be an option or parameter here, but is unknown (s.yaml, line 2). Did you mean `mass`?",
    ),
    "unknown part": (
        "kind: odin",
        "kind: oddin",
        "`plant.vehicle.kind` must be a part in vehicles, but is oddin (s.yaml, line 2). Did you mean `odin`?",
    ),
    "part that is no word": (
        "kind: odin",
        "kind: 3",
        "`plant.vehicle.kind` must name one of the vehicles, but is 3 (s.yaml, line 2)",
    ),
    "missing key": (
        "reference: {kind: setpoint, position: [2, 3, 4, 0, 0, 1]}\n",
        "",
        "`reference` must be given (s.yaml). Add `reference:` to the scenario",
    ),
    "missing option": (", position: [2, 3, 4, 0, 0, 1]", "", "`reference.position` must be given (s.yaml, line 7)"),
    "empty key": (
        "reference: {kind: setpoint, position: [2, 3, 4, 0, 0, 1]}\n",
        "reference:\n",
        "`reference` must be a mapping of keys to values, but is empty (s.yaml, line 7)",
    ),
    "list for a part": (
        "vehicle: {kind: odin, mass: 125}",
        "vehicle: [odin]",
        "`plant.vehicle` must be a name, or a mapping with `kind` and options, but is ['odin'] (s.yaml, line 2)",
    ),
    "negative mass": ("mass: 125", "mass: -1", "`plant.vehicle.mass` must be positive, but is -1 kg (s.yaml, line 2)"),
    "NaN": ("mass: 125", "mass: .nan", "`plant.vehicle.mass` must be finite, but is nan (s.yaml, line 2)"),
    "infinity": ("mass: 125", "mass: .inf", "`plant.vehicle.mass` must be finite, but is inf (s.yaml, line 2)"),
    "text for a number": (
        "mass: 125",
        "mass: heavy",
        "`plant.vehicle.mass` must be a number or a list of numbers, but is 'heavy' (s.yaml, line 2)",
    ),
    "boolean for a number": (
        "mass: 125",
        "mass: true",
        "`plant.vehicle.mass` must be a number or a list of numbers, but is True (s.yaml, line 2)",
    ),
    "no is a word": ("duration: 0.1", "duration: no", "`loop.duration` must be a number, but is 'no' (s.yaml, line 9)"),
    "quoted number": (
        "duration: 0.1",
        "duration: '1e-3'",
        "`loop.duration` must be a number, but is '1e-3' (s.yaml, line 9). Write it without quotes: 1e-3",
    ),
    "number for a boolean": (
        "seed: 3",
        "model: {speed_sensor: 1}",
        "`model.speed_sensor` must be true or false, but is 1 (s.yaml, line 11)",
    ),
    "list for a number": (
        "mass: 125",
        "mass: [1, 2]",
        "`plant.vehicle.mass` must be one number, but is of shape (2,) (s.yaml, line 2)",
    ),
    "wrong vector length": (
        "position: [2, 3, 4, 0, 0, 1]",
        "position: [2, 3, 4]",
        "`reference.position` must have 6 entries (north, east, down, roll, pitch, yaw), but is 3 long (s.yaml, line 7)",
    ),
    "short centre of gravity": (
        "mass: 125",
        "r_g: [0, 0]",
        "`plant.vehicle.r_g` must be a list of 3 numbers, but is of shape (2,) (s.yaml, line 2)",
    ),
    "preset of a preset": (
        "kind: paper,",
        "kind: paper, preset: robust,",
        "`controller.preset` must be left out, because `paper` is a preset of `rcaf`, but is robust (s.yaml, line 4)",
    ),
    "law with presets and none named": (
        "kind: paper,",
        "kind: rcaf,",
        "`controller.preset` must be given (s.yaml, line 4). It is one of paper, robust, learning",
    ),
    "matrix of wrong size": (
        "mass: 125",
        "added_mass: [[1, 0], [0, 1]]",
        "`plant.vehicle.added_mass` must have shape (6, 6), but is of shape (2, 2) (s.yaml, line 2)",
    ),
    "ragged matrix": (
        "feedback: [1, 2]",
        "feedback: [[1, 2], [3]]",
        "`controller.feedback` must have rows of equal length and numbers of ordinary size, but is [[1, 2], [3]] "
        "(s.yaml, line 5)",
    ),
    "K not Hurwitz": (
        "feedback: [1, 2]",
        "feedback: [-1, 2]",
        "`controller.feedback` must make the error dynamics Hurwitz, but is (-1, 2) (s.yaml, line 5). "
        "Both k1 and k2 must be positive, as in Table 1: (1, 2)",
    ),
    "Q not positive definite": (
        "[0, 10]]",
        "[0, -10]]",
        "`controller.weight` must be positive definite, but is a matrix with smallest eigenvalue -10 (s.yaml, line 6)",
    ),
    "Q not symmetric": (
        "[[10, 0]",
        "[[10, 1]",
        "`controller.weight` must be symmetric, but is off by 1 (s.yaml, line 6)",
    ),
    "negative resistance": (
        "fidelity: ideal",
        "fidelity: ideal, motor: {resistance: -1.2}",
        "`plant.thruster.motor.resistance` must be positive, but is -1.2 (s.yaml, line 3)",
    ),
    "unknown fidelity": (
        "fidelity: ideal",
        "fidelity: perfect",
        "`plant.thruster.fidelity` must be one of ideal, static, shaft, electromechanical, but is perfect (s.yaml, line 3)",
    ),
    "too many sets": (
        "feedback: [1, 2]",
        "sets: 1000000000",
        "`controller.sets` must be at most 100, but is 1000000000 (s.yaml, line 5)",
    ),
    "negative duration": (
        "duration: 0.1",
        "duration: -1",
        "`loop.duration` must be greater than 0, but is -1 (s.yaml, line 9)",
    ),
    "duration that is no number": (
        "duration: 0.1",
        "duration: .nan",
        "`loop.duration` must be a finite number, but is nan (s.yaml, line 9)",
    ),
    "endless duration": (
        "duration: 0.1",
        "duration: .inf",
        "`loop.duration` must be a finite number, but is inf (s.yaml, line 9)",
    ),
    "huge duration": (
        "duration: 0.1",
        "duration: 1e9",
        "`loop.duration` must be less than or equal to 1000000, but is 1000000000.0 (s.yaml, line 9)",
    ),
    "record that fills the memory": (
        "duration: 0.1",
        "duration: 1e5",
        "`loop.record` must be at least 0.1 s, so that the run has at most 1000000 records, but is 0.01 s "
        "(s.yaml, line 9)",
    ),
    "tiny sampling time": (
        "dt: 1e-3",
        "dt: 1e-12",
        "`loop.dt` must be at least 5e-11 s, so that the run has at most 2000000000 sampling times, but is 1e-12 s "
        "(s.yaml, line 9)",
    ),
    "shorter than a record": (
        "duration: 0.1",
        "duration: 0.001",
        "`loop.duration` must be at least one record (0.01 s), but is 0.001 s (s.yaml, line 9)",
    ),
    "record not a multiple of dt": (
        "record: 1e-2",
        "record: 1.5e-3",
        "`loop.record` must be a whole number of steps of `loop.dt` (0.001 s), but is 0.0015 s (s.yaml, line 9). Take 0.001 or 0.002 s",
    ),
    "record shorter than dt": (
        "record: 1e-2",
        "record: 1e-4",
        "`loop.record` must be a whole number of steps of `loop.dt` (0.001 s), but is 0.0001 s (s.yaml, line 9). Take 0.001 s",
    ),
    "unknown loop": (
        "dt: 1e-3",
        "kind: continous",
        "`loop.kind` must be 'sampled' or 'continuous', but is 'continous' (s.yaml, line 9)",
    ),
    "window that ends before it starts": (
        "seed: 3",
        "steady: {start: 5, stop: 2}",
        "`steady.stop` must be later than steady.start (5 s), but is 2 s (s.yaml, line 11)",
    ),
    "every step of one ODE": (
        "record: 1e-2}",
        "record: 1e-2, kind: continuous}\nsteady: {every_step: true}",
        "`steady.every_step` must be false when `loop.kind` is continuous, but is true (s.yaml, line 10). "
        "A continuous loop has no control steps: `loop.record` sets the times that count",
    ),
    "negative seed": ("seed: 3", "seed: -1", "`seed` must be greater than or equal to 0, but is -1 (s.yaml, line 11)"),
    "short initial state": (
        "position: [0, 0, 0, 0, 0, 0]",
        "position: [0, 0]",
        "`initial.position` must have 6 entries (north, east, down, roll, pitch, yaw), but is 2 long (s.yaml, line 10)",
    ),
    "word in the initial state": (
        "position: [0, 0, 0, 0, 0, 0]",
        "position: [0, 0, 0, 0, 0, x]",
        "`initial.position[5]` must be a number, but is 'x' (s.yaml, line 10)",
    ),
    "NaN in the initial state": (
        "position: [0, 0, 0, 0, 0, 0]",
        "position: [0, 0, 0, 0, 0, .nan]",
        "`initial.position[5]` must be a finite number, but is nan (s.yaml, line 10)",
    ),
    "disturbance of the wrong size": (
        "kind: u1",
        "kind: wrench, value: [1, 2]",
        "`disturbance.value` must have 6 entries (surge, sway, heave, roll, pitch, yaw), but is of shape (2,) (s.yaml, line 8)",
    ),
    "negative noise": (
        "seed: 3",
        "navigation: {kind: white_noise, velocity: -1}",
        "`navigation.velocity` must be zero or positive, but is -1 (s.yaml, line 11)",
    ),
    "noise of the wrong size": (
        "seed: 3",
        "navigation: {kind: white_noise, velocity: [0.1, 0.1, 0.1, 0.1, 0.1]}",
        "`navigation.velocity` must be one number, or 6 of them, one per axis, but is of shape (5,) (s.yaml, line 11)",
    ),
    "noise that the rule for gains needs, of the wrong size": (
        "{kind: paper,\n  feedback: [1, 2],\n  weight: [[10, 0], [0, 10]]}",
        "robust\nnavigation: {kind: white_noise, velocity: [0.1, 0.1]}",
        "`navigation.velocity` must be one number, or 6 of them, one per axis, but is of shape (2,) (s.yaml, line 5)",
    ),
    "bias of the wrong size": (
        "seed: 3",
        "navigation: {kind: degraded, velocity_bias: [0.1, 0.1]}",
        "`navigation.velocity_bias` must be one number, or 6 of them, one per axis, but is of shape (2,) (s.yaml, line 11)",
    ),
    "two sources of samples": (
        "kind: u1",
        "kind: table, file: d.csv, csv: t",
        "`disturbance.csv` must be left out when there is another source of samples, but is given together with `file` "
        "(s.yaml, line 8)",
    ),
    "duplicate key": (
        "seed: 3",
        "seed: 3\nseed: 4",
        f"{YAML} the key `seed` is given twice, first in line 11 (s.yaml, line 12). Remove one of them",
    ),
    "tab": ("seed: 3", "\tseed: 3", f"{YAML} it has a tab (s.yaml, line 11). Indent with spaces"),
    "unclosed bracket": (
        "seed: 3",
        "seed: [3",
        f"{YAML} a `[` is not closed, or lacks a comma (s.yaml, line 11). Add `]`, and commas between the entries",
    ),
    "unknown alias": ("seed: 3", "seed: *other", f"{YAML} found undefined alias 'other' (s.yaml, line 11)"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_is_one_exact_line(refused, tmp_path, mistake):
    old, new, said = MISTAKES[mistake]
    assert old in SCENARIO
    (tmp_path / "s.yaml").write_text(SCENARIO.replace(old, new, 1))
    assert refused("simulate", "s.yaml", "--out", "out") == said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "`s.yaml` must be a mapping of keys to values, but is empty"),
        ("# nothing\n", "`s.yaml` must be a mapping of keys to values, but is empty"),
        ("- plant\n", "`s.yaml` must be a mapping of keys to values, but is a list"),
        ("plant", "`s.yaml` must be a mapping of keys to values, but is a single str"),
        ("[" * 1000, "`s.yaml` must have at most 20 levels, but is more deeply nested (s.yaml, line 1)"),
        ("a: &a [*a]\n", f"{YAML} found undefined alias 'a' (s.yaml, line 1)"),
        ("a: 1\n---\nb: 2\n", "`s.yaml` must be one YAML document, but is several (s.yaml, line 2)"),
        ("? [a, b]\n: 1\n", "`s.yaml` must have words for keys, but is a list or mapping for a key (s.yaml, line 1)"),
        ("loop: {<<: 3}", f"{YAML} `<<` takes a mapping, or a list of them (s.yaml, line 1)"),
        ("seed: 1" + 5000 * "0", f"{YAML} Exceeds the limit (4300 digits) for integer string conversion"),
        ("seed: 0x" + 4000 * "f", "`s.yaml` must have integers of at most 1024 bits, but is one of 4002 characters"),
    ],
)
def test_file_that_is_no_scenario(refused, tmp_path, text, said):
    (tmp_path / "s.yaml").write_text(text)
    assert refused("simulate", "s.yaml").startswith(said)


def test_file_that_is_not_text(refused, tmp_path):
    (tmp_path / "s.yaml").write_bytes(b"\xff\xfe\x00\x01")
    assert refused("simulate", "s.yaml") == ("`s.yaml` must be a text file in UTF-8. Save it with this encoding")


def test_file_that_is_missing(refused):
    assert refused("simulate", "none.yaml") == (
        "`none.yaml` must be an existing file, but is not. `undertow init` writes a scenario to start from"
    )


@pytest.mark.parametrize(
    ("text", "said"), [("no result", "damaged, incomplete, or not a netCDF file"), ("", "empty (0 bytes)")]
)
def test_result_file_that_is_none(refused, tmp_path, text, said):
    (tmp_path / "run.nc").write_text(text)
    assert refused("simulate", "run.nc").startswith(f"`run.nc` must be a result file of undertow, but is {said}. ")


def test_numbers_and_words_of_yaml_1_2(tmp_path):
    (tmp_path / "s.yaml").write_text("a: 1e-3\nb: no\nc: on\nd: 012\n")
    assert read(tmp_path / "s.yaml").data == {"a": 1e-3, "b": "no", "c": "on", "d": 12}


def test_merged_keys_have_the_place_of_what_they_belong_to(refused, tmp_path):
    text = SCENARIO.replace("disturbance: {kind: u1}", "disturbance: &x {kind: u1, scale: big}\nnavigation:\n  <<: *x")
    (tmp_path / "s.yaml").write_text(text.replace("disturbance: &x", "model: &x"))
    said = "`model.kind` must be an option here, but is unknown (s.yaml, line 8). "
    assert refused("simulate", "s.yaml").startswith(said)
