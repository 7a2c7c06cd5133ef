"""A vehicle from a YAML file: in a scenario, in its result file, described; and every mistake in one is one line."""

import dataclasses
from pathlib import Path

import jax
import numpy as np
import pytest
import xarray as xr
from good_scenario import SCENARIO, SMALL
from messages import named
from ruamel.yaml import YAML

from undertow.core.errors import BadInput
from undertow.physics.vehicles import bluerov2_heavy
from undertow.scenario.build import build
from undertow.scenario.factory import make
from undertow.scenario.part_cache import PartCache
from undertow.scenario.reading import read
from undertow.scenario.vehicle_file import read_vehicle
from undertow.simulation.loop.dataset import input_names

ROV = (Path(__file__).parents[2] / "examples" / "my_rov.yaml").read_text()
FLIES = SCENARIO.replace("{kind: odin, mass: 125}", "my_rov.yaml").replace("position: [2, 3", "position: [0, 0")


PARTS = PartCache()
SMALL_PLANT = "vehicle: {kind: vehicles/my_rov.yaml, mass: 13.6}, thruster: linear_voltage, ledger: false"


@pytest.fixture
def rov(tmp_path):
    """Write the example vehicle, something in it replaced; returns its path."""

    def write(old="", new=""):
        assert old in ROV
        (tmp_path / "my_rov.yaml").write_text(ROV.replace(old, new) if old else ROV)
        return tmp_path / "my_rov.yaml"

    return write


def equal(one, other, rtol=1e-12):
    for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True):
        np.testing.assert_allclose(a, b, rtol=rtol, atol=1e-12)


def test_file_is_the_catalogue_vehicle(rov):
    """The example has the numbers of bluerov2_heavy(), and 0.0134 m^3 of water instead of its rounded buoyancy."""
    vehicle = read_vehicle(rov()).vehicle()
    equal(dataclasses.replace(vehicle, size=None), bluerov2_heavy())
    np.testing.assert_array_equal(vehicle.size, [0.457, 0.575, 0.254])  # which the catalogue does not have
    assert vehicle.name == "my_rov"
    sources = dict(vehicle.sources)
    assert sources["*"].startswith("von Benzon et al. 2022") and sources["weight"].startswith(
        "derived: m g with g = 9.82"
    )


def test_whole_matrices_and_inertia_about_the_origin(rov):
    """I_o = I_cg + m (|r|^2 1 - r r^T)."""
    path = rov("r_g: [0, 0, 0]  ", "r_g: [0, 0, 0.02]")
    about_centre = read_vehicle(path).vehicle()
    added = 13.5 * 0.02**2
    np.testing.assert_allclose(np.diag(about_centre.inertia), [0.26 + added, 0.23 + added, 0.37], rtol=1e-12)
    whole = {"inertia_about": "origin", "inertia": np.asarray(about_centre.inertia).tolist()}
    equal(read_vehicle(path, whole).vehicle(), about_centre)


def test_changed_keys_are_as_if_they_stood_there(rov):
    """A changed mass takes the weight along where the file has gravity; a given weight replaces gravity."""
    path = rov()
    vehicle = read_vehicle(path, {"mass": 14}).vehicle()
    assert float(vehicle.weight) == pytest.approx(14 * 9.82)
    assert float(vehicle.buoyancy) == pytest.approx(131.588)
    heavy = read_vehicle(path, {"weight": 133.0, "buoyancy": 134.0}).vehicle()
    assert (float(heavy.weight), float(heavy.buoyancy)) == (133.0, 134.0)


def test_rounded_directions_are_made_of_length_1(rov):
    vehicle = read_vehicle(rov("azimuth: -45}", "direction: [0.707, -0.707, 0]}")).vehicle()
    np.testing.assert_allclose(vehicle.thruster_directions[0], [np.sqrt(0.5), -np.sqrt(0.5), 0], rtol=1e-12)


def test_elevation_is_upward(rov):
    vehicle = read_vehicle(rov("azimuth: -45}", "azimuth: 90, elevation: 30}")).vehicle()
    np.testing.assert_allclose(vehicle.thruster_directions[0], [0, np.sqrt(0.75), -0.5], atol=1e-15)


def test_description_needs_no_file(rov, tmp_path):
    vehicle, description = make("vehicles", {"kind": "my_rov.yaml", "mass": 14}, rov().parent)
    (tmp_path / "my_rov.yaml").unlink()
    assert description["kind"] == "my_rov.yaml"
    again, same = make("vehicles", description, tmp_path)
    assert same == description
    for a, b in zip(jax.tree.leaves(vehicle), jax.tree.leaves(again), strict=True):
        assert np.array_equal(a, b)


@pytest.mark.slow
@pytest.mark.parametrize("repeated", [False, True])
def test_scenario_and_its_repetition_without_the_file(rov, undertow, tmp_path, repeated):
    """Kept in another folder than the scenario's, changed, and gone when the same loop is built, and run, again."""
    (tmp_path / "vehicles").mkdir()
    rov().rename(tmp_path / "vehicles" / "my_rov.yaml")
    text = SMALL.replace("kind: double_integrator, axes: 1, limit: 20", SMALL_PLANT)
    (tmp_path / "s.yaml").write_text(text.replace("position: [1]", "position: [1, 0, 0, 0, 0, 0]"))
    said = undertow("simulate", "s.yaml", "--out", "out")
    assert said.code == 0, said.err
    resolved = YAML(typ="safe", pure=True).load((tmp_path / "out/scenario.yaml").read_text())["plant"]["vehicle"]
    assert resolved["kind"] == "my_rov.yaml" and resolved["contents"]["mass"] == 13.6
    loop = build(read(tmp_path / "s.yaml")).closed_loop
    (tmp_path / "vehicles" / "my_rov.yaml").unlink()
    for source in ("out/run.nc", "out/scenario.yaml"):
        one, other = (jax.tree.leaves(each) for each in (loop, build(read(tmp_path / source)).closed_loop))
        assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))
        if not repeated:
            continue
        again = undertow("simulate", source, "--out", "again", "--overwrite")
        assert again.code == 0, again.err
        with xr.open_dataset(tmp_path / "out/run.nc") as first, xr.open_dataset(tmp_path / "again/run.nc") as second:
            assert first.attrs["content_hash"] == second.attrs["content_hash"]


def test_described(rov, undertow):
    rov()
    said = undertow("describe", "my_rov.yaml")
    assert said.code == 0 and said.out.startswith("my_rov.yaml (vehicle file)")
    assert "diag(0.26, 0.23, 0.37)" in said.out and "von Benzon" in said.out


# What is replaced, by what, what is said; of the vehicle file.
MISTAKES = {
    "missing key": ("mass: 13.5   ", "# ", "`mass` must be given: kg, in air (my_rov.yaml)"),
    "misspelt key": (
        "added_mass:",
        "aded_mass:",
        "`aded_mass` must be a key of a vehicle file, but is unknown (my_rov.yaml, line 18). Did you mean `added_mass`?",
    ),
    "two keys of other programs": (
        "r_g: [0, 0, 0]                       # m, centre of gravity\nr_b",
        "COG: [0, 0, 0]\nCOB",
        "`COG` must be a key of a vehicle file, but is unknown (my_rov.yaml, line 11). Did you mean `r_g`? Also unknown: `COB`",
    ),
    "misspelt key of a thruster": (
        "azimuth: 45}",
        "asimuth: 45}",
        "`thrusters[1].asimuth` must be a key of a thruster, but is unknown (my_rov.yaml, line 26). Did you mean `azimuth`?",
    ),
    "wrong length": (
        "[141, 217, 190, 1.19, 0.47, 1.5]",
        "[141, 217, 190]",
        "`quadratic_damping` must be the 6 diagonal entries (surge, sway, heave, roll, pitch, yaw) or a 6 x 6 matrix, but is 3 long (my_rov.yaml, line 20)",
    ),
    "short vector": (
        "r_b: [0, 0, -0.01]",
        "r_b: [0, -0.01]",
        "`r_b` must have 3 entries (forward, starboard, down), but is 2 long (my_rov.yaml, line 12)",
    ),
    "NaN": ("0.37]", ".nan]", "`inertia` must be finite, but is [0.26, 0.23, nan] (my_rov.yaml, line 14)"),
    "text for a number": ("mass: 13.5", "mass: heavy", "`mass` must be a number, but is 'heavy' (my_rov.yaml, line 7)"),
    "unit in the value": (
        "mass: 13.5",
        "mass: 13.5 kg",
        "`mass` must be a number, but is '13.5 kg' (my_rov.yaml, line 7). Write the number alone, without a unit",
    ),
    "negative mass": ("mass: 13.5", "mass: -13.5", "`mass` must be positive, but is -13.5 kg (my_rov.yaml, line 7)"),
    "two weights": (
        "gravity: 9.82 ",
        "weight: 132.57\ngravity: 9.82",
        "`weight` must be left out when there is `gravity`, but is 132.57 (my_rov.yaml, line 8)",
    ),
    "no buoyancy": (
        "volume: 0.0134 ",
        "# ",
        "`volume` must be given (my_rov.yaml). Or `buoyancy`, N, instead of `volume`, m^3, and `water_density`, kg/m^3",
    ),
    "inertia about something else": (
        "inertia_about: centre_of_gravity",
        "inertia_about: CO",
        "`inertia_about` must be one of centre_of_gravity, origin, but is CO (my_rov.yaml, line 15)",
    ),
    "two ways of pointing": (
        "azimuth: -45}",
        "azimuth: -45, direction: [1, 0, 0]}",
        "`thrusters[0].azimuth` must be left out when there is a `direction`, but is -45 (my_rov.yaml, line 25)",
    ),
    "pointing nowhere": (
        ", azimuth: -45}",
        "}",
        "`thrusters[0].direction` must be given (my_rov.yaml, line 25). Or give `azimuth` and `elevation` in degrees",
    ),
    "matrix of another layout": (
        "  - [-0.1888, 0.1888, 0.1888, -0.1888, 0, 0, 0, 0]\n",
        "",
        "`thruster_matrix` must have 6 rows (surge, sway, heave, roll, pitch, yaw) with one entry for each of the 8 thrusters, but is of shape (5, 8) (my_rov.yaml, line 36)",
    ),
    "signs of the added mass": (
        "[6.36, 7.12, 18.68,",
        "[6.36, 7.12, -18.68,",
        "`added_mass` must leave M = M_RB + M_A positive definite, but is such that its smallest eigenvalue is -5.18 (my_rov.yaml, line 18). With mass and inertia alone it would be: check the signs of the added mass",
    ),
    "name of a thruster that breaks a line": (
        "azimuth: 45}",
        'azimuth: 45, name: "bow\\n<b>"}',
        "`thrusters[1].name` must be of letters, digits, spaces and _ . -, and begin with a letter or digit, but is bow <b> (my_rov.yaml, line 26)",
    ),
    "name of a thruster that is a list": (
        "azimuth: 45}",
        "azimuth: 45, name: [bow]}",
        "`thrusters[1].name` must be text, but is ['bow'] (my_rov.yaml, line 26)",
    ),
    "name of a thruster without end": (
        "azimuth: 45}",
        f"azimuth: 45, name: {'x' * 3000}}}",
        "`thrusters[1].name` must be at most 24 characters long, but is 3000 long (my_rov.yaml, line 26)",
    ),
    "empty name of a thruster": (
        "azimuth: 45}",
        "azimuth: 45, name: ' '}",
        "`thrusters[1].name` must be a name, but is empty (my_rov.yaml, line 26). Leave it out for the name that follows from the position",
    ),
    "two thrusters of one name": (
        "azimuth: -45}\n  - {position: [0.156, -0.111, 0.085], azimuth: 45}",
        "azimuth: -45, name: bow}\n  - {position: [0.156, -0.111, 0.085], azimuth: 45, name: Bow}",
        "`thrusters[1].name` must differ from `thrusters[0].name`, but is Bow (my_rov.yaml, line 26)",
    ),
    "name of another thruster": (
        "azimuth: -45}",
        "azimuth: -45, name: T3}",
        "`thrusters[0].name` must be a name that means nothing else among the targets of faults, but is T3 (my_rov.yaml, line 25)",
    ),
    "name of a quantity": (
        "azimuth: -45}",
        "azimuth: -45, name: depth}",
        "`thrusters[0].name` must be a name that means nothing else among the targets of faults, but is depth (my_rov.yaml, line 25)",
    ),
    "not YAML": ("r_g: [0, 0, 0] ", "r_g: [0, 0, 0 ", None),
    "direction of a corner": (
        "azimuth: -45}",
        "direction: [1, -1, 0]}",
        "`thrusters[0].direction` must have length 1, but is 1.41421 long (my_rov.yaml, line 25). Divide it by its length",
    ),
}


@pytest.mark.full
@pytest.mark.parametrize(
    ("target", "number"),
    [("bow left", 2), ("t2 Bow Left", 2), ("T2", 2), ("thruster 2", 2), ("vertical stern port", 8), ("T9 bow", None)],
)
def test_own_names_of_thrusters_are_targets_of_faults(rov, tmp_path, target, number):
    rov("azimuth: 45}", "azimuth: 45, name: bow left}")
    (tmp_path / "s.yaml").write_text(f"{FLIES}faults: [{{target: {target}, mode: off}}]\n")
    if number is None:
        with pytest.raises(BadInput, match="its thrusters are T1 bow starboard, T2 bow left, T3 stern starboard"):
            build(read(tmp_path / "s.yaml"), PARTS)
        return
    built = build(read(tmp_path / "s.yaml"), PARTS)
    assert (built.resolved["faults"][0]["target"], built.resolved["faults"][0]["number"]) == ("thruster", number)
    assert input_names(built.closed_loop.plant)[:2] == ("T1 bow starboard", "T2 bow left")


@pytest.mark.full
@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_is_one_line_in_a_scenario(rov, refused, tmp_path, mistake):
    old, new, said = MISTAKES[mistake]
    rov(old, new)
    (tmp_path / "s.yaml").write_text(FLIES)
    complaint = refused("simulate", "s.yaml")
    if said is None:
        assert complaint.startswith("`plant.vehicle` must be valid YAML, but is not: ")
        assert "(my_rov.yaml, line " in complaint
    else:
        assert named(complaint) == named(f"`plant.vehicle.{said[1:]}")


@pytest.mark.parametrize("mistake", sorted(set(MISTAKES) - {"direction of a corner", "signs of the added mass"}))
def test_mistake_is_one_line_in_a_check(rov, refused, mistake):
    old, new, said = MISTAKES[mistake]
    rov(old, new)
    complaint = refused("check", "my_rov.yaml")
    if said is None:
        assert complaint.startswith("`my_rov.yaml` must be valid YAML, but is not: ")
    else:
        assert named(complaint) == named(said)


def test_missing_file(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(FLIES)
    said = f"`plant.vehicle` must be an existing file, but is {tmp_path / 'my_rov.yaml'} (s.yaml, line 2)"
    assert refused("simulate", "s.yaml") == said
    assert refused("check", "my_rov.yaml") == "`my_rov.yaml` must be an existing file, but is not. Files there: s.yaml"


def test_mistake_of_the_scenario_is_placed_there(rov, refused, tmp_path):
    rov()
    (tmp_path / "s.yaml").write_text(FLIES.replace("my_rov.yaml", "{kind: my_rov.yaml, mass: -1}"))
    assert refused("simulate", "s.yaml") == "`plant.vehicle.mass` must be positive, but is -1 kg (s.yaml, line 2)"


def test_contents_that_are_no_vehicle(tmp_path):
    with pytest.raises(BadInput, match="`contents` must be a mapping, as in a vehicle file, but is 3"):
        read_vehicle(tmp_path / "x.yaml", {"contents": 3})
