"""Defects of published models, each as a vehicle file with the numbers of its source: the linter finds every one.

Not here, since no vehicle file shows them: thrust limits (von Benzon's 30.4 N for a T200), tables and plants (T500,
MLS2EM), and defects of code; for those see the docstring of undertow/scenario/checks/vehicle_lint.
"""

import warnings
from pathlib import Path

import pytest

from undertow.physics.thrusters import paper_table3, t200
from undertow.scenario.checks.part_check import check_contract
from undertow.scenario.checks.thruster_check import derived_of_thruster
from undertow.scenario.checks.vehicle_lint import lint
from undertow.scenario.vehicle_file import read_vehicle

FOLDER = Path(__file__).parent / "defects"

# File -> every rule that speaks, errors in capitals, with words it must say. What is said beyond the defect itself
# is true of these vehicles too: five directions for six thrusters, Ng's buoyancy, the poses that go with nantes' hull.
EXPECTED = {
    "odin_tcm_sign": {"PRINTED_MATRIX": "give 0.7071 for `thrusters[1]` in sway, but is -0.7071. Opposite sign"},
    "odin_tcm_poses": {"same_line": "`thrusters[1]`", "mirror": "`thrusters[2]`"},
    "odin_radius": {
        "balance": "116.5 N below the weight (-9.5 %)",
        "sphere": "62.5 kg, where half the displaced mass is 56.56",
    },
    "g500": {
        "sphere": "1.5 x 1 x 1 m, with the added mass of a sphere",
        "copied": "that of odin, digit for digit, for 98",
    },
    "blue_heavy": {
        "GRAVITY": "114.8 N, 8.504 m/s^2 times 13.5 kg. Does `buoyancy` fit better? Then the two are swapped",
        "PRINTED_MATRIX": "give 0.218 for `thrusters[4]` in roll, but is -0.218 (4 entries of this row are off). They have the opposite sign",
        "balance": "2 N below the weight (-1.7 %). It sinks when the power fails. Are weight and buoyancy swapped?",
    },
    "blue_six": {
        "PRINTED_MATRIX": "0.109 for `thrusters[4]` in roll, but is -0.218",
        "rank": "no thruster controls pitch: the thruster matrix has rank 5 of 6",
    },
    "blue_six_poses": {
        "arm": "0.218 m from the centre of gravity, of a hull with a width of 0.338 m",
        "rank": "rank 5",
    },
    "ng2024": {
        "GYRATION": "below 0.261 m in pitch, but is one of 0.295 m",
        "PRINTED_MATRIX": "give 0.04731 for `thrusters[0]` in roll, but is 0.067 (4 entries of this row are off). The arm was not multiplied by sin 45",
        "balance": "6.675 N above the weight (+5.9 %)",
    },
    "centrale_nantes": {
        "GYRATION": "in roll, but is one of 0.588 m",
        "copied": "1/100 of that of rexrov, digit for digit",
        "upright": "85.31 mm",
        "arm": "0.191 m",
        "rank": "rank 5",
    },
    "zero_added_mass": {"no_added_mass": "zero in every direction"},
    "zero_added_moments": {"no_added_mass": "zero in roll, pitch, yaw"},
    "hkpolyu": {
        "UPRIGHT": "387.2 mm above it, in a hull 250 mm high",
        "no_added_mass": "zero in sway, roll",
        "gyration": "below 0.208 m in pitch, but is one of 0.237 m",
        "rank": "rank 5",
    },
    "vonbenzon_signs": {
        "DEFINITE": "eigenvalue -5.18",
        "ADDED_MASS_SIGN": "-6.36 in surge",
        "DAMPING_SIGN": "-13.7 in surge, -33 in heave, -0.8 in pitch. Published derivatives such as X_u are negative",
    },
}


def test_every_file_is_expected():
    assert {path.stem for path in FOLDER.glob("*.yaml")} == set(EXPECTED)


@pytest.mark.parametrize("name", EXPECTED)
def test_defect_is_found(name):
    findings = lint(read_vehicle(FOLDER / f"{name}.yaml").data.facts())
    rules = {finding.rule.upper() if finding.level == "error" else finding.rule for finding in findings}
    assert rules == set(EXPECTED[name])
    said = [finding.sentence() for finding in findings]
    for words in EXPECTED[name].values():
        assert any(words in sentence for sentence in said), (words, said)


@pytest.mark.full
@pytest.mark.parametrize("name", EXPECTED)
def test_command_line_says_where(name, capsys):
    from undertow.cli.main import run

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code = run(["check", str(FOLDER / f"{name}.yaml")])
    out, err = capsys.readouterr()
    wrong = any(rule.isupper() for rule in EXPECTED[name])
    assert (code, err) == (2 if wrong else 0, "")
    first = out.splitlines()[0]
    assert first.startswith("Error: " if wrong else "Advice: ") and f"({name}.yaml, line " in first


@pytest.mark.full
def test_motor_of_table_3():
    """k_t / k_e = 117: at 10 V the shaft would give 537 W from 78 W."""
    (finding,) = check_contract(paper_table3())
    assert finding.level == "advice" and "torque constant / back-EMF constant is 117" in finding.says
    rows = {what: value for what, value, _ in derived_of_thruster(paper_table3())}
    assert rows["torque constant / back-EMF constant"] == "116.9"
    assert float(rows["shaft power / electrical power"].split(",")[0]) == pytest.approx(537 / 78.5, rel=1e-2)


@pytest.mark.full
def test_motor_with_equal_constants():
    assert check_contract(t200()) == ()
    rows = {what: value for what, value, _ in derived_of_thruster(t200())}
    assert all(0.3 < float(share) < 1 for share in rows["shaft power / electrical power"].split(","))
