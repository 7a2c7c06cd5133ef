"""Each rule at its edge: a sound vehicle with one number spoilt, and what is said about it."""

from pathlib import Path

import numpy as np
import pytest

from undertow.physics.vehicles import odin
from undertow.scenario.checks.vehicle_lint import facts_of, lint
from undertow.scenario.vehicle_file import read_vehicle

SOUND = read_vehicle(Path(__file__).parents[2] / "examples" / "my_rov.yaml").data.facts()
LOOSE = SOUND._replace(size=None, printed_matrix=None)
BOX = 13.5 / 12 * np.diag([0.575**2 + 0.254**2, 0.457**2 + 0.254**2, 0.457**2 + 0.575**2])


def rules(facts):
    return {finding.rule.upper() if finding.level == "error" else finding.rule for finding in lint(facts)}


def said(facts, rule):
    return " ".join(finding.sentence() for finding in lint(facts) if finding.rule == rule)


def coupled(matrix, row, column, value):
    changed = matrix.copy()
    changed[row, column] = value
    return changed


def without(matrix, axis):
    return coupled(matrix, axis, axis, 0.0)


def test_sound_vehicle_has_no_findings():
    assert rules(SOUND) == rules(LOOSE) == set()
    assert rules(SOUND._replace(inertia=BOX)) == set()


SPOILT = {
    "mass in grams": ({"mass": 13500.0}, {"GRAVITY", "gyration", "copied"}, "Is `mass` in grams?"),
    "weight in kg": ({"weight": 13.5}, {"GRAVITY", "BALANCE"}, "Is `weight` in kg?"),
    "gravity a little off": ({"weight": 13.5 * 9.9}, {"gravity", "balance"}, "9.9 m/s^2 times 13.5 kg"),
    "buoyancy in kg": ({"buoyancy": 13.4}, {"BALANCE", "added_mass_size"}, "Is one of them in kg"),
    "half a newton of buoyancy too much": ({"buoyancy": 1.051 * 132.57}, {"balance"}, "(+5.1 %)"),
    "heavy": ({"buoyancy": 0.985 * 132.57}, {"balance"}, "It sinks when the power fails"),
    "centre of buoyancy with the wrong sign": ({"r_b": np.array([0, 0, 0.01])}, {"UPRIGHT"}, "10 mm below it"),
    "no righting": ({"r_b": np.zeros(3)}, {"upright"}, "Nothing rights it"),
    "off level": ({"r_g": np.array([0.003, 0, 0])}, {"trim"}, "16.8 degrees off level"),
    "inertia in kg cm^2": ({"inertia": 1e4 * SOUND.inertia}, {"GYRATION"}, "As numbers in kg cm^2 they would fit"),
    "inertia in g cm^2": ({"inertia": 1e7 * SOUND.inertia}, {"GYRATION"}, "As numbers in g cm^2 they would fit"),
    "inertia against the triangle": ({"inertia": np.diag([0.2, 0.1, 0.37])}, {"TRIANGLE"}, "0.37 against 0.1 + 0.2"),
    "inertia not definite": (
        {"inertia": coupled(coupled(SOUND.inertia, 0, 1, 0.3), 1, 0, 0.3)},
        {"TRIANGLE"},
        "principal inertia -0.0",
    ),
    "negative inertia": ({"inertia": np.diag([-0.46, 0.23, 0.37])}, {"TRIANGLE"}, "principal inertia -0.46"),
    "inertia not symmetric": ({"inertia": coupled(SOUND.inertia, 0, 1, 0.01)}, {"SYMMETRY"}, "off by 0.01"),
    "inertia of a point": ({"inertia": SOUND.inertia / 40}, {"gyration"}, "Is the mass in grams?"),
    "roll and yaw exchanged": (
        {"inertia": SOUND.inertia[::-1, ::-1]},
        {"axes"},
        "`inertia` should be smaller in roll than in yaw, but is 0.37 against 0.26 kg m^2",
    ),
    "axes of a long box": (
        {
            "size": np.array([0.9, 0.5, 0.4]),
            "mass": 20.0,
            "weight": 196.4,
            "buoyancy": 197.0,
            "inertia": np.diag([0.98, 0.6, 0.85]),
        },
        None,
        "In a uniform box of 0.9 x 0.5 x 0.4 m (`size`) it is 0.39 times as large",
    ),
    "added mass in g": (
        {"added_mass": 1e3 * SOUND.added_mass},
        {"added_mass_size"},
        "1.39e+03 times the displaced 13.4 kg",
    ),
    "coupling as large as the axes": (
        {"linear_damping": coupled(SOUND.linear_damping, 0, 2, -60.0)},
        {"DISSIPATION"},
        "take power from every motion, but is giving",
    ),
    "nothing slows roll": ({"quadratic_damping": without(SOUND.quadratic_damping, 3)}, {"undamped"}, "in roll"),
    "direction as corners": ({"directions": 1.41421356 * SOUND.directions}, {"DIRECTION"}, "1.414 long. Divide"),
    "positions in mm": ({"positions": 1e3 * SOUND.positions, "printed_matrix": None}, {"ARM"}, "another unit?"),
    "one thruster at 3 m": (
        {"positions": SOUND.positions + 3.0 * np.eye(8, 3), "size": None, "printed_matrix": None},
        None,
        "13.3 times the side of a cube of the volume",
    ),
    "angles in radians, and r_b with the wrong sign": (
        {"angles": {"thrusters[0].azimuth": -0.785}, "r_b": np.array([0, 0, 0.01]), "printed_matrix": None},
        {"degrees", "UPRIGHT"},
        "Write -45",
    ),
    "angles in radians against the matrix": (
        {"angles": {"thrusters[0].azimuth": -0.785}, "printed_matrix": -SOUND.printed_matrix},
        {"DEGREES"},
        "`thruster_matrix` contradicts it",
    ),
    "size in mm": ({"size": 1e3 * SOUND.size}, {"VOLUME"}, "Is `size` in metres?"),
    "size in km": ({"size": 1e-3 * SOUND.size}, None, "Is `size` in metres?"),
    "four thrusters": (
        {"positions": SOUND.positions[4:], "directions": SOUND.directions[4:], "printed_matrix": None},
        {"rank"},
        "no thruster controls surge, sway and yaw: the thruster matrix has rank 3 of 6",
    ),
}


@pytest.mark.parametrize("name", SPOILT)
def test_spoilt_number(name):
    changes, expected, words = SPOILT[name]
    facts = SOUND._replace(**changes)
    if expected is not None:
        assert rules(facts) == expected
    assert any(words in finding.sentence() for finding in lint(facts)), lint(facts)


@pytest.mark.parametrize("factor", [0.95, 1.05])
def test_gyration_is_measured_against_the_hull(factor):
    """All mass in the corners has I = m (b^2 + h^2) / 4: more than that is an error."""
    corners = 3 * BOX
    found = rules(SOUND._replace(inertia=corners * (1.02 * factor) ** 2))
    assert found == ({"gyration"} if factor < 1 else {"GYRATION"})


def test_without_a_size_only_gross_inertia_is_an_error():
    assert rules(LOOSE._replace(inertia=4 * SOUND.inertia)) == {"gyration"}
    assert rules(LOOSE._replace(inertia=1e4 * SOUND.inertia)) == {"GYRATION"}


def test_one_thruster_moved_loses_its_mirror_image():
    moved = LOOSE.positions.copy()
    moved[4, 0] = 0.17
    facts = LOOSE._replace(positions=moved)
    assert rules(facts) == {"mirror"}
    assert "`thrusters[4]`" in said(facts, "mirror") and "`thrusters[5]`" in said(facts, "mirror")


def test_small_coupling_still_dissipates():
    """|a_12| < 2 sqrt(d_1 d_2) leaves the symmetric part positive."""
    limit = 2 * np.sqrt(13.7 * 33.0)
    for share, found in ((0.95, set()), (1.1, {"DISSIPATION"})):
        assert rules(SOUND._replace(linear_damping=coupled(SOUND.linear_damping, 0, 2, share * limit))) == found


def test_units_and_axes_do_not_matter_to_dissipation():
    """Sampled angular velocities go with the size of the vehicle."""
    assert rules(facts_of(odin())) == set()


@pytest.mark.parametrize("factor", [10.0, 0.1])
def test_power_of_ten_of_another_vehicles_inertia(factor):
    facts = LOOSE._replace(
        inertia=factor * SOUND.inertia, mass=factor * 13.5, weight=factor * 132.57, buoyancy=factor * 131.588
    )
    assert "copied" in rules(facts) and "bluerov2_heavy" in said(facts, "copied")


def test_same_inertia_and_mass_is_the_same_vehicle():
    assert "copied" not in rules(SOUND._replace(mass=14.0, weight=137.5, buoyancy=137.0))
