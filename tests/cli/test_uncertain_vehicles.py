"""Vehicle files whose numbers have deviations: read, samples from, written and read again; every mistake is one line."""

from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from undertow.core.errors import BadInput
from undertow.physics.vehicles import bluerov2_heavy, npsauv2
from undertow.scenario.factory import make
from undertow.scenario.reading import read
from undertow.scenario.results.netcdf import save
from undertow.scenario.results.run_scenario import run_scenario
from undertow.scenario.vehicle_file import read_vehicle
from undertow.scenario.vehicle_parameters import NAMES, name_at, parameter_values
from undertow.scenario.vehicle_samples import deviations_of, sample
from undertow.scenario.vehicle_writer import contents_of, plant_section, write_vehicle

ROV = (Path(__file__).parents[2] / "examples" / "my_rov.yaml").read_text()
MASS, SURGE = "mass: 13.5 ", "added_mass: [6.36,"
# Correlations of four parameters, of which three are positive numbers.
SECTION = {
    "parameters": ["added_mass.surge", "linear_damping.surge", "net_buoyancy", "thruster_gain"],
    "deviations": [0.8, 1.2, 0.3, 0.05],
    "values": {"thruster_gain": 0.93},
    "correlation": [[1], [0.2, 1], [-0.3, 0.1, 1], [0.9, 0.4, 0.0, 1]],
}


@pytest.fixture
def rov(tmp_path):
    """Write the example vehicle with some texts replaced and sections added; returns its path."""

    def write(replaced=(), **sections):
        text = ROV
        for old, new in dict(replaced).items():
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "my_rov.yaml"
        with path.open("w", encoding="utf-8") as file:
            file.write(text)
            if sections:
                yaml = YAML(typ="safe")
                yaml.default_flow_style = False
                yaml.dump(sections, file)
        return path

    return write


def test_deviations_beside_numbers(rov):
    """The values are those of the file without them; weight and volume make up the net buoyancy."""
    replaced = {
        MASS: "mass: 13.5 +- 0.2 ",
        SURGE: "added_mass: [6.36+-0.8,",
        "7.12, 18.68": "7.12 \u00b1 10 %, 1.868e1 +- 1",
        "0.0134 ": "0.0134 +- 1 % ",
        "r_b: [0, 0, -0.01]": "r_b: [0, 0, -0.01 +- 0.003]",
        "{position: [0.156, 0.111, 0.085]": "{position: [0.156 +- 0.01, 0.111, 0.085]",
    }
    plain = read_vehicle(rov())
    path = rov(replaced)
    vehicle_file = read_vehicle(path)
    assert {**vehicle_file.contents, "uncertainty": None} == {**plain.contents, "uncertainty": None}
    assert deviations_of(plain) == {}
    found = deviations_of(vehicle_file)
    assert (
        found["mass"] == (13.5, 0.2) and found["added_mass.surge"] == (6.36, 0.8) and found["r_b.z"] == (-0.01, 0.003)
    )
    assert found["added_mass.sway"] == pytest.approx((7.12, 0.712)) and found["added_mass.heave"] == (18.68, 1.0)
    assert found["net_buoyancy"] == pytest.approx((-0.1 * 9.82, 0.134 * 9.82)), "0.1 kg heavy; 1 % of 13.4 kg"
    assert len(found) == 6
    _, described = make("vehicles", path.name, path.parent)
    assert described["contents"]["uncertainty"]["parameters"] == list(found)
    again, _ = make("vehicles", described, Path())
    np.testing.assert_array_equal(again.added_mass, plain.vehicle().added_mass)


def test_whole_matrices_have_deviations_on_their_diagonal(rov):
    matrix = "[[0.26 +- 0.03, 0, 0], [0, 0.23, 0], [0, 0, 0.37 +- 10 %]]"
    vehicle_file = read_vehicle(
        rov({"inertia: [0.26, 0.23, 0.37] ": f"inertia: {matrix} ", "r_g: [0, 0, 0] ": "r_g: [0, 0, 0.1] "})
    )
    found = deviations_of(vehicle_file)
    assert found["inertia.roll"] == pytest.approx((0.26 + 13.5 * 0.01, 0.03)), "about the origin"
    assert found["inertia.yaw"] == pytest.approx((0.37, 0.037))
    assert name_at("linear_damping[0][4]") == "" and name_at("linear_damping[4][4]") == "linear_damping.pitch"


MISTAKES = {
    "13.5 +- -0.2": "`mass` must have a deviation above 0, but is '13.5 +- -0.2' (my_rov.yaml, line 7). Write the number alone",
    "13.5 +- 0": "`mass` must have a deviation above 0",
    "13.5 +- nan": "`mass` must be finite, and so must its deviation, but is '13.5 +- nan' (my_rov.yaml, line 7)",
    "13.5 +- inf": "`mass` must be finite, and so must its deviation",
    "13.5 +- some": "`mass` must be `value +- deviation` or `value +- share %`, but is '13.5 +- some' (my_rov.yaml, line 7)",
    "+- 0.2": "`mass` must be `value +- deviation` or `value +- share %`",
    "13.5 +- 2 kg": "`mass` must be `value +- deviation` or `value +- share %`",
    "-13.5 +- 2": "`mass` must be positive, but is -13.5 kg (my_rov.yaml, line 7)",
}


@pytest.mark.parametrize("text", MISTAKES)
def test_a_deviation_that_cannot_be_is_one_line(rov, text):
    with pytest.raises(BadInput) as error:
        read_vehicle(rov({MASS: f"mass: {text} "}))
    assert str(error.value).startswith(MISTAKES[text]) and "\n" not in str(error.value)


def test_zero_added_mass_has_no_deviation(rov):
    with pytest.raises(BadInput, match=r"`added_mass.pitch` must be positive where it has a deviation, but is 0"):
        read_vehicle(rov({"0.189, 0.135": "0.189, 0 +- 0.1"}))


def without(key):
    return {name: value for name, value in SECTION.items() if name != key}


SECTIONS = {
    "not a mapping": (3, "`uncertainty` must be a mapping with the keys parameters, deviations, correlation, values"),
    "unknown key": (SECTION | {"sigma": 1}, "`uncertainty.sigma` must be left out, but is unknown"),
    "no deviations": (without("deviations"), "`uncertainty.deviations` must be a list, but is not given"),
    "wrong name": (
        SECTION | {"parameters": ["added_mass.surge", "drag", "net_buoyancy", "thruster_gain"]},
        "`uncertainty.parameters[1]` must be a parameter of a vehicle, but is 'drag'",
    ),
    "misspelt name": (
        SECTION | {"parameters": ["added_mass.serge", "linear_damping.surge", "net_buoyancy", "thruster_gain"]},
        "`uncertainty.parameters[0]` must be a parameter of a vehicle, but is 'added_mass.serge' (my_rov.yaml, line LINE). "
        "Did you mean `added_mass.surge`?",
    ),
    "twice": (
        SECTION | {"parameters": ["mass", "mass", "net_buoyancy", "thruster_gain"]},
        "`uncertainty.parameters[1]` must be there once, but is mass",
    ),
    "too few": (
        SECTION | {"deviations": [1.0]},
        "`uncertainty.deviations` must be 4 numbers, one per entry of `parameters`",
    ),
    "negative": (
        SECTION | {"deviations": [1.0, -1.0, 1.0, 1.0]},
        "`uncertainty.deviations[1]` must be positive, but is -1",
    ),
    "nan": (
        SECTION | {"deviations": [1.0, 1.0, float("nan"), 1.0]},
        "`uncertainty.deviations[2]` must be finite, but is nan",
    ),
    "square": (
        SECTION | {"correlation": np.eye(4).tolist()},
        "`uncertainty.correlation` must be 4 rows of 1 to 4 numbers: the lower triangle, with ones at the ends",
    ),
    "diagonal": (
        SECTION | {"correlation": [[1], [0, 2], [0, 0, 1], [0, 0, 0, 1]]},
        "`uncertainty.correlation[1]` must end with 1, but is 2",
    ),
    "beyond 1": (
        SECTION | {"correlation": [[1], [1.5, 1], [0, 0, 1], [0, 0, 0, 1]]},
        "`uncertainty.correlation[1]` must hold numbers from -1 to 1, but is [1.5, 1]",
    ),
    "indefinite": (
        SECTION | {"correlation": [[1], [0.9, 1], [0, 0, 1], [0.9, -0.9, 0, 1]]},
        "`uncertainty.correlation` must be positive definite, but is of least eigenvalue -0.8",
    ),
    "value inside": (
        SECTION | {"values": {"mass": 13.0}},
        "`uncertainty.values.mass` must be left out: another key of the vehicle file holds it",
    ),
}


@pytest.mark.parametrize("mistake", SECTIONS)
def test_a_section_that_cannot_be_is_one_line(rov, mistake):
    section, message = SECTIONS[mistake]
    path = rov(uncertainty=section)
    with pytest.raises(BadInput) as error:
        read_vehicle(path)
    line = next((i for i, text in enumerate(path.read_text().splitlines(), 1) if "serge" in text), 0)
    message = message.replace("LINE", str(line))
    assert str(error.value).startswith(message) and "(my_rov.yaml" in str(error.value)


def test_deviations_in_two_places_agree(rov):
    at_number = {SURGE: "added_mass: [6.36 +- 0.8,"}
    assert deviations_of(read_vehicle(rov(at_number, uncertainty=SECTION)))["added_mass.surge"] == (6.36, 0.8)
    with pytest.raises(BadInput) as error:
        read_vehicle(rov({SURGE: "added_mass: [6.36 +- 0.5,"}, uncertainty=SECTION))
    assert str(error.value).startswith(
        "`uncertainty.deviations[0]` must be the deviation that stands beside the number, 0.5, "
    )


@pytest.mark.full
def test_samples_have_the_distribution(rov):
    """Medians, deviations and correlations of 4,000 vehicles, positive numbers by their logarithms."""
    count = 4_000
    vehicle_file = read_vehicle(rov(uncertainty=SECTION))
    samples = sample(vehicle_file, 5, count)
    numbers = deviations_of(vehicle_file)
    assert list(samples) == SECTION["parameters"]
    deviates = []
    for name, values in samples.items():
        value, deviation = numbers[name]
        is_positive = name in ("added_mass.surge", "thruster_gain")
        scale = np.sqrt(np.log1p((deviation / value) ** 2)) if is_positive else deviation
        deviates.append((np.log(values / value) if is_positive else values - value) / scale)
    np.testing.assert_allclose(np.mean(deviates, axis=1), 0.0, atol=4 / np.sqrt(count))
    np.testing.assert_allclose(np.std(deviates, axis=1), 1.0, atol=4 / np.sqrt(count))
    expected = vehicle_file.uncertainty.correlation
    np.testing.assert_allclose(np.corrcoef(deviates), expected, atol=4 / np.sqrt(count))
    first = sample(vehicle_file, 5, 3)
    again = sample(vehicle_file, np.random.default_rng(5), 3)
    assert all(np.array_equal(first[name], again[name]) for name in first)


def test_samples_are_vehicles(rov):
    """Damping is not negative, and the mass matrix positive definite where two of five draws would not be."""
    off = np.diag([6.36, 7.12, 18.68, 0.189, 0.135, 0.222])
    off[0, 1] = off[1, 0] = 18.0
    text = "added_mass: " + str(off.tolist()).replace("6.36", "6.36 +- 8") + "\n#"
    vehicle_file = read_vehicle(rov({"added_mass: ": text, "[13.7, 0, 33": "[13.7 +- 20, 0, 33"}))
    samples = sample(vehicle_file, 1, 200)
    assert samples["linear_damping.surge"].min() == 0.0
    least = 18.0**2 / (13.5 + 7.12) - 13.5
    assert samples["added_mass.surge"].min() > least > 2.0
    with pytest.raises(BadInput, match="`vehicle` must have deviations, but is without"):
        sample(read_vehicle(rov()), 1, 2)


def test_values_of_a_scenario(rov):
    """Weight follows mass and buoyancy weight; an inertia about the origin; the rest stays."""
    path = rov({"r_g: [0, 0, 0] ": "r_g: [0, 0, 0.1] "})
    values = {
        "mass": 15.0,
        "net_buoyancy": 2.0,
        "inertia": {"roll": 0.5},
        "linear_damping": {"yaw": 3.0},
        "r_b": {"x": 0.01},
    }
    changed = read_vehicle(path, {"values": values}).vehicle()
    plain = read_vehicle(path).vehicle()
    assert float(changed.weight) == pytest.approx(15 * 9.82) and float(
        changed.buoyancy - changed.weight
    ) == pytest.approx(2)
    assert float(changed.linear_damping[5, 5]) == 3.0 and float(changed.r_b[0]) == 0.01
    np.testing.assert_array_equal(changed.added_mass, plain.added_mass)
    inertia = read_vehicle(path, {"values": {"inertia": {"roll": 0.5}}}).vehicle().inertia
    np.testing.assert_allclose(np.diagonal(inertia), [0.5, *np.diagonal(plain.inertia)[1:]], rtol=1e-14)
    for mistake, message in (
        ({"drag": 1.0}, "`values.drag` must be a parameter of a vehicle"),
        ({"lag": 1.0}, "`values.lag` must be given at `plant.thruster`"),
        ({"mass": "heavy"}, "`values.mass` must be a number"),
        (3, "`values` must be a mapping of parameters"),
    ):
        with pytest.raises(BadInput) as error:
            read_vehicle(path, {"values": mistake})
        assert str(error.value).startswith(message)


PROVENANCE = {"date": "2026-10-11", "version": "0.1.0", "logs": [{"name": "a.bag", "sha256": "00"}], "fixed": ["mass"]}


@pytest.mark.parametrize("base", ["example", "bluerov2_heavy", "npsauv2"])
def test_what_is_written_reads_back(rov, tmp_path, base):
    """Every parameter that is positive or free, with a full correlation matrix."""
    contents = (
        read_vehicle(rov()).contents
        if base == "example"
        else contents_of({"bluerov2_heavy": bluerov2_heavy, "npsauv2": npsauv2}[base]())
    )
    generator = np.random.default_rng(2)
    names = [name for name in (*NAMES, "thruster_gain.T2") if not name.startswith("r_g")]
    present = parameter_values(read_vehicle(tmp_path, {"contents": contents}).data.hull)
    values = {name: (present.get(name, 1.0) or 1.0) * float(generator.uniform(0.9, 1.1)) for name in names}
    deviations = {name: abs(values[name]) * float(generator.uniform(0.01, 0.5)) for name in names}
    root = generator.normal(size=(len(names), 2 * len(names)))
    covariance = root @ root.T
    scale = np.sqrt(np.diagonal(covariance))
    correlation = covariance / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    path = tmp_path / "identified.yaml"
    write_vehicle(path, contents, values, deviations, correlation, PROVENANCE)
    written = read_vehicle(path)
    for name, number in deviations_of(written).items():
        assert number.value == pytest.approx(values[name], rel=1e-12, abs=1e-12), name
        assert number.deviation == pytest.approx(deviations[name], rel=1e-12), name
    assert list(deviations_of(written)) == names
    np.testing.assert_allclose(written.uncertainty.correlation, (correlation + correlation.T) / 2, rtol=0, atol=1e-15)
    assert written.contents["identified"] == PROVENANCE
    assert f"mass: {values['mass']!r}  # kg, in air" in path.read_text()
    with pytest.raises(BadInput, match="`inertia` must leave M = M_RB"):
        write_vehicle(path, contents, {"inertia.roll": -1e6}, {})
    assert read_vehicle(path).contents == written.contents, "nothing half-written"


def test_the_plant_of_a_written_vehicle():
    plant = {"kind": "hybrid_vehicle", "vehicle": "odin", "thruster": "t200", "ledger": False}
    assert plant_section(plant, "a.yaml", 8, {"mass": 3.0}) == plant | {"vehicle": "a.yaml"}
    common = plant_section(plant, "a.yaml", 8, {"thruster_gain": 0.9, "lag": 1.2})["thruster"]
    assert common == {"kind": "adjusted", "thruster": "t200", "gain": 0.9, "lag": 1.2}
    single = plant_section(plant, "a.yaml", 3, {"thruster_gain.T2": 0.8, "reverse_gain": 0.7})["thruster"]
    inner = {"kind": "adjusted", "thruster": "t200", "gain": [1.0, 0.8, 1.0]}
    assert single == {"kind": "adjusted", "thruster": inner, "reverse_gain": 0.7}
    with pytest.raises(BadInput, match=r"`thruster_gain.T4` must be of one of 3 thrusters"):
        plant_section(plant, "a.yaml", 3, {"thruster_gain.T4": 0.8})


@pytest.mark.full
def test_a_run_keeps_where_its_vehicle_comes_from(rov, tmp_path):
    """The result file has deviations and provenance, and repeats the run without the vehicle file."""
    path = rov({MASS: "mass: 13.5 +- 0.2 "}, uncertainty=SECTION, identified=PROVENANCE)
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(
        "plant: {vehicle: my_rov.yaml, thruster: {kind: adjusted, thruster: t200, gain: 0.93}}\ncontroller: pid\n"
        "reference: {kind: setpoint, position: [0, 0, 0, 0, 0, 0.2]}\nloop: {duration: 1, dt: 0.02, record: 0.1}\n"
    )
    result = run_scenario(read(scenario))
    save(result.dataset, tmp_path / "run.nc")
    path.unlink()
    contents = read(tmp_path / "run.nc").data["plant"]["vehicle"]["contents"]
    assert contents["identified"] == PROVENANCE
    assert contents["uncertainty"]["deviations"] == [*SECTION["deviations"], 0.2]
    again = run_scenario(read(tmp_path / "run.nc"))
    np.testing.assert_array_equal(again.outcome.signals["position"], result.outcome.signals["position"])
