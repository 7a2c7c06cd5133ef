"""Every published parameter set on every layout: no errors, and only advice that its docstring gives too."""

import importlib

import numpy as np
import pytest

from undertow.core import catalogue
from undertow.scenario.checks.vehicle_lint import derived, facts_of, lint, mass

# Hull -> what is said about it, with the number that causes it; about layouts, below.
HULLS = {
    ("bluerov2", "hkpolyu"): {
        "gyration": "one of 0.237 m",  # box of 0.457 x 0.338 x 0.25 m and 11.26 kg: 0.26 kg m^2 in pitch, not 0.63
        "no_added_mass": "zero in sway, roll",
    },
    ("bluerov2", "einarsson_lipenitis2020"): {"upright": "100 mm above it"},  # -0.01 m is likely meant
    ("bluerov2", "gazebo_box_drag"): {"no_added_mass": "zero in every direction"},
    ("bluerov2", "centrale_nantes"): {
        "gyration": "one of 0.722 m",
        "upright": "85.31 mm above it",
        "copied": "1/100 of that of rexrov",
    },
    ("bluerov2_heavy", "gazebo_box_drag"): {"no_added_mass": "zero in every direction"},
    ("bluerov2_heavy", "ng2024"): {"gyration": "one of 0.295 m", "balance": "6.675 N above the weight (+5.9 %)"},
}
RANKS = {"bluerov2": "rank 5 of 6", "lauv": "rank 1 of 6", "npsauv2": "rank 1 of 6", "remus100": "rank 1 of 6"}


def variants():
    for name, part in sorted(catalogue.names("vehicles").items()):
        module = importlib.import_module(f"undertow.physics.vehicles.{name}")
        for hull in getattr(module, "PARAMETERS", [None]):
            for layout in getattr(module, "LAYOUTS", [None]):
                given = {"parameters": hull, "layout": layout}
                yield name, hull, part(**{key: value for key, value in given.items() if value})


VARIANTS = list(variants())


@pytest.mark.parametrize(
    ("name", "hull", "vehicle"), VARIANTS, ids=[f"{n}-{h}-{i}" for i, (n, h, _) in enumerate(VARIANTS)]
)
def test_published_vehicle(name, hull, vehicle):
    expected = HULLS.get((name, hull), {}) | ({"rank": RANKS[name]} if name in RANKS else {})
    findings = lint(facts_of(vehicle))
    assert {finding.rule for finding in findings} == set(expected)
    assert all(finding.level == "advice" for finding in findings)
    for finding in findings:
        assert expected[finding.rule] in finding.sentence()


# Length, width and height of the hulls, m, rounded; they only matter where moments of inertia differ clearly.
SIZES = {
    "bluerov2": (0.457, 0.338, 0.254),
    "bluerov2_heavy": (0.457, 0.575, 0.254),
    "lauv": (1.8, 0.15, 0.15),
    "npsauv2": (5.3, 1.0, 0.6),
    "odin": (0.63, 0.63, 0.63),
    "remus100": (1.33, 0.19, 0.19),
    "rexrov": (2.6, 1.5, 1.6),
}


def test_no_published_vehicle_has_its_axes_exchanged():
    """With its size, too, which the parts do not hold; the same with roll and yaw exchanged is found where they differ."""
    exchanged = set()
    for name, hull, vehicle in VARIANTS:
        facts = facts_of(vehicle)._replace(size=np.array(SIZES[name]))
        assert not any(mass.axes(facts)), (name, hull)
        if any(mass.axes(facts._replace(inertia=facts.inertia[::-1, ::-1]))):
            exchanged.add(name)
    assert exchanged == {"bluerov2", "bluerov2_heavy", "rexrov"}


def test_facts_have_the_vehicles_own_matrices():
    for _, _, vehicle in VARIANTS:
        facts = facts_of(vehicle)
        for mine, its in (
            (facts.mass_matrix, vehicle.mass_matrix()),
            (facts.thruster_matrix, vehicle.thruster_matrix()),
        ):
            np.testing.assert_allclose(mine, its, rtol=1e-12, atol=1e-12 * np.abs(its).max())


def test_derived_numbers():
    """The check table of the published data, computed by other code."""
    rows = {what: value for what, value, _ in derived(facts_of(catalogue.names("vehicles")["bluerov2_heavy"]()))}
    assert rows["(B - W) / W"] == "-0.74"
    assert rows["righting moment"] == "1.316"
    assert rows["eigenvalues of M"].startswith("0.365, ") and rows["eigenvalues of M"].endswith(", 32.18")
    assert rows["singular values of the thruster matrix"] == "2, 1.42, 1.419, 0.4343, 0.3776, 0.2391"
    assert rows["condition, moments per longest arm"] == "2.2"
    assert rows["radii of gyration, roll, pitch, yaw"] == "0.1388, 0.1305, 0.1656"
