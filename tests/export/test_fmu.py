"""FMUs of controller and vehicle, stepped by FMPy: the bits of a simulation, names, and what masters do wrong."""

import functools
import shutil
import xml.etree.ElementTree as ET

import fmpy
import numpy as np
import pytest
from export.fmpy_unit import Failed, Unit, closed_loop, without_library
from export.scenarios import HEAVY, ODIN, PENDULUM
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu

import undertow as ut
from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.outside.export.fmu import compiled, export_fmu
from undertow.scenario.build import build
from undertow.scenario.reading import dump

pytestmark = pytest.mark.compiler


def units(scenario, folder, **options):
    """Paths of the two units of a scenario."""
    export_fmu(build(scenario), **options).exported.write(folder)
    return folder / "controller.fmu", folder / "vehicle.fmu"


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory):
    """The units of the pendulum, for every test that is not about vehicles."""
    return units(PENDULUM, tmp_path_factory.mktemp("pendulum"))


@pytest.fixture(scope="module")
def odin(tmp_path_factory):
    """The units of ODIN with full motors."""
    return units(ODIN, tmp_path_factory.mktemp("odin"), attitude="quaternion")


@pytest.fixture
def controller(pendulum, tmp_path):
    return Unit(pendulum[0], tmp_path / "controller")


@pytest.fixture
def vehicle(pendulum, tmp_path):
    return Unit(pendulum[1], tmp_path / "vehicle")


@functools.cache
def record_of(plant, precision="float64"):
    """The run of `ODIN` or of `PENDULUM`."""
    return ut.simulate_scenario({"odin": ODIN, "pendulum": PENDULUM}[plant] | {"precision": precision}).dataset


def compared(scenario, record, paths, folders):
    """Largest differences of positions and commands between the units and a simulation."""
    several = [Unit(path, folder) for path, folder in zip(paths, folders, strict=True)]
    steps = round(scenario["loop"]["duration"] / scenario["loop"]["dt"])
    positions, commands = closed_loop(*several, steps)
    true = record["position"].values[:-1, : len(positions[0])]
    return np.abs(positions - true).max(), np.abs(commands - record["commanded_input"].values[:-1]).max()


def test_the_closed_loop_has_the_bits_of_a_simulation(odin, tmp_path):
    """ODIN with electromechanical thrusters: the quaternion says all of the attitude."""
    assert compared(ODIN, record_of("odin"), odin, [tmp_path / "c", tmp_path / "v"]) == (0.0, 0.0)


def test_signals_of_the_plant_are_outputs(odin, tmp_path):
    """The energies of the thrusters after 300 steps."""
    record = record_of("odin").isel(time=300)
    controller, vehicle = (Unit(path, tmp_path / path.stem) for path in odin)
    closed_loop(controller, vehicle, 300)
    energies = vehicle.names("energy_")
    assert len(energies) == 9 and vehicle.variables["energy_source"].unit == "J" and vehicle["energy_source"] > 1
    np.testing.assert_array_equal(vehicle.get(energies), [record[name].item() for name in energies])


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_another_plant_has_them_too(pendulum, tmp_path, precision):
    scenario, record = PENDULUM | {"precision": precision}, record_of("pendulum", precision)
    paths = pendulum if precision == "float64" else units(scenario, tmp_path)
    assert compared(scenario, record, paths, [tmp_path / "c", tmp_path / "v"]) == (0.0, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("attitude, nearest", [("quaternion", 0.0), ("euler", 1e-9)])
def test_the_heavy_in_current_and_waves(tmp_path, attitude, nearest):
    """Euler angles are turned into the quaternion again, with rounding; positions in m, commands in V."""
    paths = units(HEAVY, tmp_path, attitude=attitude)
    record = ut.simulate_scenario(HEAVY).dataset
    position, command = compared(HEAVY, record, paths, [tmp_path / "c", tmp_path / "v"])
    assert position <= nearest and command <= 10 * nearest


@pytest.mark.slow
def test_sources_that_fmpy_compiles(odin, tmp_path):
    folders = [without_library(path, tmp_path) for path in odin]
    for folder in folders:
        (folder / "build").mkdir()
        build_platform_binary(folder, folder / "build")
    assert compared(ODIN, record_of("odin"), odin, folders) == (0.0, 0.0)


def test_the_controller_has_the_bits_of_an_autopilot(odin, tmp_path):
    unit, autopilot = Unit(odin[0], tmp_path / "c"), ut.Autopilot(ODIN, attitude="quaternion")
    unit["scenario_reference"] = False
    chance, found, expected = np.random.default_rng(0), [], []
    motion = [*unit.names("position."), *unit.names("velocity."), *unit.names("attitude.")]
    for k in range(30):
        position, velocity, turned = chance.normal(size=3), chance.normal(size=6), chance.normal(size=4)
        goal, applied, speeds = chance.normal(size=(3, 6)), chance.normal(size=8), chance.normal(size=(2, 8))
        if k == 20:
            velocity[2] = np.nan  # not measured
        unit.set(motion, [*position, *velocity, *turned])
        unit.set(unit.names("target."), goal.ravel())
        unit.set(unit.names("applied"), applied)
        unit.set(unit.names("propeller_"), speeds.ravel())
        unit.slave.doStep(k * unit.period, unit.period)
        found.append(unit.get(unit.names("command")))
        given = {"target": tuple(goal), "propellers": tuple(speeds)} | ({"applied": applied} if k else {})
        taken = autopilot.step if k else autopilot.start
        expected.append(taken(position, velocity, turned, **given))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("which", ["odin", "pendulum"])
def test_fmpy_has_no_findings(which, request):
    for path in request.getfixturevalue(which):
        assert validate_fmu(str(path)) == []


def test_variables_have_names_units_and_meanings(odin):
    controller, vehicle = (fmpy.read_model_description(path).modelVariables for path in odin)
    known = {one.name: one for one in vehicle}
    assert (known["position.north"].unit, known["velocity.surge"].unit, known["velocity.yaw"].unit) == (
        "m",
        "m/s",
        "rad/s",
    )
    assert (known["command[8]"].unit, known["external_wrench.roll"].unit) == ("V", "N m")
    assert known["applied[1]"].description == "input applied over the last step to thruster T1 bow port"
    assert all(one.description for one in [*controller, *vehicle])
    units = {one.name: one.unit for one in vehicle if one.causality == "output"}
    shared = [one for one in controller if one.causality == "input" and not one.name.startswith("target")]
    assert shared and all(units[one.name] == one.unit for one in shared)


def test_parameters_of_the_start(vehicle, pendulum, tmp_path):
    assert vehicle["position.angle"] == 0.05
    other = Unit(pendulum[1], tmp_path / "vehicle", start=None)
    other.begin(initial__position__angle=-0.2)
    assert (other["position.angle"], vehicle["position.angle"]) == (-0.2, 0.05)
    with pytest.raises(Failed):
        other["initial.position.angle"] = 0.1
    assert "initial.position.angle is a parameter and can be set before the first step only." in other.log[-1]


def test_a_load_from_outside_acts_like_a_disturbance(tmp_path):
    """The constant force of the scenario, or the same from outside, which does not oppose but acts."""
    still = PENDULUM | {"disturbance": "none"}
    scenarios = still, still | {"disturbance": {"kind": "wrench", "value": [0.3]}}
    free, loaded = (units(one, tmp_path / str(i))[1] for i, one in enumerate(scenarios))
    first, second = Unit(free, tmp_path / "free"), Unit(loaded, tmp_path / "loaded")
    first["external_wrench.angle"] = -0.3
    for k in range(100):
        for unit in (first, second):
            unit.slave.doStep(k * unit.period, unit.period)
    assert first["position.angle"] == second["position.angle"] != 0.05


def test_a_step_of_several_sampling_times(vehicle, pendulum, tmp_path):
    other = Unit(pendulum[1], tmp_path / "vehicle", start=7.0)  # the disturbance begins with the simulation
    vehicle.slave.doStep(0.0, 10 * vehicle.period)
    for k in range(10):
        other.slave.doStep(7 + k * other.period, other.period)
    assert vehicle.get(vehicle.outputs()) == other.get(other.outputs())


def test_a_state_is_kept_restored_and_written(controller):
    def steps(first):
        for k in range(first, first + 20):
            controller["position.angle"] = np.sin(k)
            controller.slave.doStep(k * controller.period, controller.period)
        return controller["command[1]"]

    steps(0)
    state = controller.slave.getFMUstate()
    text, expected = controller.slave.serializeFMUstate(state), steps(20)
    controller.slave.setFMUstate(state)
    assert steps(20) == expected
    again = controller.slave.deSerializeFMUstate(text)
    controller.slave.setFMUstate(again)
    assert steps(20) == expected
    for one in (state, again):
        controller.slave.freeFMUstate(one)


def test_damaged_and_foreign_states_are_refused(controller, vehicle):
    text, chance = controller.slave.serializeFMUstate(controller.slave.getFMUstate()), np.random.default_rng(0)
    others = [vehicle.slave.serializeFMUstate(vehicle.slave.getFMUstate()), b"", text[:-1], text + b"x"]
    for _ in range(200):
        damaged = bytearray(text)
        damaged[chance.integers(len(text))] ^= int(chance.integers(1, 256))
        others.append(bytes(damaged))
    for other in others:
        with pytest.raises(Failed):
            controller.slave.deSerializeFMUstate(other)
        assert "bytes are not a state of this unit, or they are damaged." in controller.log[-1]


def test_reset_begins_again(vehicle):
    vehicle["command[1]"] = 5.0
    vehicle.slave.doStep(0.0, vehicle.period)
    moved = vehicle["position.angle"]
    vehicle.slave.reset()
    vehicle.begin()
    assert vehicle["position.angle"] == 0.05 != moved
    vehicle["command[1]"] = 5.0
    vehicle.slave.doStep(0.0, vehicle.period)
    assert vehicle["position.angle"] == moved


@pytest.mark.parametrize(
    "size, point, said",
    [
        (0.0015, 0.0, "The step size must be a multiple of the sampling time, 0.001 s, but is 0.0015 s."),
        (0.0, 0.0, "The step size must be a multiple of the sampling time, 0.001 s, but is 0 s."),
        (-0.001, 0.0, "The step size must be a multiple"),
        (np.nan, 0.0, "The step size must be a multiple"),
        (1e300, 0.0, "The step size must be a multiple"),
        (0.001, 0.5, "The step must begin at 0 s, where the last one ended, but begins at 0.5 s."),
        (0.001, np.nan, "The step must begin at 0 s"),
    ],
)
def test_steps_that_are_none(vehicle, size, point, said):
    before = vehicle.get(vehicle.outputs())
    with pytest.raises(Failed):
        vehicle.slave.doStep(point, size)
    assert vehicle.log[-1].startswith(said)
    assert vehicle.get(vehicle.outputs()) == before
    vehicle.slave.doStep(0.0, vehicle.period)


def test_numbers_that_are_none(controller, vehicle):
    """What was not measured is NaN, but not at the first step, and no other input."""
    controller["position.angle"] = np.nan
    with pytest.raises(Failed):
        controller.slave.doStep(0.0, controller.period)
    assert controller.log == ["position.angle must be finite, but is not, at 0 s: no step was taken."]
    controller["position.angle"] = 0.1
    controller.slave.doStep(0.0, controller.period)
    controller["position.angle"] = np.nan
    controller.slave.doStep(controller.period, controller.period)
    assert np.isfinite(controller["command[1]"])
    for unit, name, t in ((controller, "applied[1]", 2e-3), (vehicle, "command[1]", 0.0)):
        unit[name] = np.inf
        with pytest.raises(Failed):
            unit.slave.doStep(t, unit.period)
        assert unit.log[-1] == f"{name} must be finite, but is not, at {t:g} s: no step was taken."


def test_a_plant_that_fails_keeps_its_last_state(vehicle):
    """The pendulum falls flat; the scenario's simulation ends there, too."""
    k = 0
    with pytest.raises(Failed):
        for k in range(3000):
            before = vehicle.get(vehicle.outputs())
            vehicle.slave.doStep(k * vehicle.period, vehicle.period)
    assert (
        "the state is that before the call: An output left the range in which the plant can be held" in vehicle.log[-1]
    )
    assert 0 < k < 2999 and vehicle.get(vehicle.outputs()) == before
    assert np.abs(vehicle["position.angle"]) < np.pi / 2


def test_calls_that_are_wrong(vehicle, pendulum, tmp_path):
    slave = vehicle.slave
    wrong = [
        (lambda: slave.getReal([999]), "There is no variable of value reference 999."),
        (lambda: slave.setReal([999], [1.0]), "There is no variable of value reference 999."),
        (lambda: slave.getInteger([0]), "initial.position.angle is no Integer."),
        (lambda: slave.setReal([vehicle.variables["applied[1]"].valueReference], [1.0]), "applied[1] is an output"),
        (lambda: slave.getString([0]), "No variable of this unit is a String."),
        (lambda: slave.enterInitializationMode(), "fmi2EnterInitializationMode must not be called now"),
        (lambda: slave.getDirectionalDerivative([0], [0], [1.0]), "This unit gives no directional derivatives."),
    ]
    for call, said in wrong:
        with pytest.raises(Failed):
            call()
        assert vehicle.log[-1].startswith(said)
    with pytest.raises(Exception, match="Failed to instantiate"):
        Unit(pendulum[1], tmp_path / "vehicle", guid="{of-another}")
    early = Unit(pendulum[1], tmp_path / "vehicle", start=None)
    with pytest.raises(Failed):
        early.slave.doStep(0.0, early.period)
    assert early.log == ["fmi2DoStep must not be called now: see the order of calls in FMI 2.0, 4.2.4."]


def test_the_same_scenario_gives_the_same_bytes(pendulum, tmp_path):
    again = units(PENDULUM, tmp_path)
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in pendulum]
    other = units(PENDULUM | {"seed": 1}, tmp_path / "other")
    guids = [fmpy.read_model_description(path).guid for path in (again[1], other[1])]
    assert guids[0] != guids[1]


def test_without_a_compiler(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    assert compiled({}, "vehicle") == (None, "there is no C compiler on this machine (no-such-compiler)")


def test_a_compiler_that_fails(monkeypatch):
    monkeypatch.setenv("CC", "false")
    with pytest.raises(BadInput, match="`CC`: the C compiler false failed on the unit vehicle"):
        compiled({}, "vehicle")


@pytest.mark.parametrize("compiler", [name for name in ("gcc", "clang") if shutil.which(name)])
def test_compilers_agree(monkeypatch, tmp_path, compiler):
    monkeypatch.setenv("CC", compiler)
    paths = units(PENDULUM, tmp_path)
    assert compared(PENDULUM, record_of("pendulum"), paths, [tmp_path / "c", tmp_path / "v"]) == (0.0, 0.0)


def test_the_command(tmp_path, capsys):
    scenario = tmp_path / "pendulum.yaml"
    scenario.write_text(dump(PENDULUM))
    assert run(["export", str(scenario), "--fmu", str(tmp_path / "fmu")]) == 0
    assert "controller.fmu and vehicle.fmu" in capsys.readouterr().out
    assert run(["export", str(scenario), "--fmu", str(tmp_path / "fmu")]) == 2
    assert "`--fmu` must be a folder without the files of an export" in capsys.readouterr().err
    description = fmpy.read_model_description(tmp_path / "fmu/vehicle.fmu")
    assert (description.defaultExperiment.stopTime, description.defaultExperiment.stepSize) == ("1.0", "0.001")


def test_a_format_that_is_unknown():
    with pytest.raises(BadInput, match="`attitude` must be one of euler, quaternion"):
        export_fmu(build(PENDULUM), attitude="degrees")


def test_the_description_is_a_file_of_its_own_right(pendulum, tmp_path):
    """Every source that is named is there, and every index of the structure is that of an output."""
    fmpy.extract(pendulum[0], tmp_path)
    root = ET.parse(tmp_path / "modelDescription.xml").getroot()
    assert all((tmp_path / "sources" / one.get("name")).exists() for one in root.iter("File"))
    variables = root.findall("ModelVariables/ScalarVariable")
    indices = [int(one.get("index")) for one in root.iter("Unknown")]
    assert {variables[i - 1].get("causality") for i in indices} == {"output"}
