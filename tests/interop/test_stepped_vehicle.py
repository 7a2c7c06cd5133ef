"""The vehicle by itself: the bits of a simulation, readings of sensors, the battery, and an end that is noticed."""

import numpy as np
import pytest
from driven_scenario import DRIVEN

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.numerics.rotations import rotation_from_quaternion
from undertow.core.status import Status
from undertow.outside.stepped_vehicle import STANDARD_GRAVITY, SteppedVehicle

pytestmark = pytest.mark.interop

STILL = np.full(8, 1500.0)


def pulses_of(run):
    """Pulses that the speed controllers were given, recorded as volts of 16."""
    return np.round(1500 + 400 * run["input"].values / 16)


def motions(vehicle, pulses, dt):
    """Position and velocity in the world at the start of each frame."""
    found = []
    for given in pulses:
        state = vehicle.state()
        found.append(np.concatenate([state.position, state.velocity]))
        assert vehicle.step(given, dt)
    return np.array(found)


def recorded(run):
    return np.concatenate([run["position"].values[:-1, :3], run["velocity"].values[:-1, :3]], axis=1)


def test_every_bit_is_that_of_a_simulation(vehicle):
    run = ut.simulate_scenario(DRIVEN).dataset
    pulses = pulses_of(run)[:-1]
    np.testing.assert_array_equal(motions(vehicle, pulses, 0.01), recorded(run))
    np.testing.assert_array_equal(vehicle.vehicle.output.applied, run["input"].values[-2])
    vehicle.restart()
    np.testing.assert_array_equal(motions(vehicle, pulses, 0.01), recorded(run))


def test_a_long_frame_is_divided_as_substeps_are(vehicle):
    """Frames of 50 Hz of a scenario of 100 Hz: a simulation at 50 Hz with two substeps."""
    scenario = DRIVEN | {"loop": {"duration": 2.0, "dt": 0.02, "record": 0.02, "substeps": 2}}
    run = ut.simulate_scenario(scenario).dataset
    np.testing.assert_array_equal(motions(vehicle, pulses_of(run)[:-1], 0.02), recorded(run))


def test_waves_are_those_of_the_simulation(written):
    """Sums of sines, added in the same order."""
    scenario = DRIVEN | {"disturbance": {"kind": "waves", "height": 0.5, "period": 5}, "seed": 7}
    run = ut.simulate_scenario(scenario).dataset
    found = motions(SteppedVehicle(written(scenario)), pulses_of(run)[:-1], 0.01)
    np.testing.assert_array_equal(found, recorded(run))


def test_a_buoyant_vehicle_stays_in_the_water(written):
    """75 s without thrust from 3 m below the surface, as behind ArduSub; it rose 12.95 m into the air."""
    buoyant = {
        "vehicle": {"kind": "bluerov2_heavy", "parameters": "wu2018"},
        "thruster": {"kind": "t200", "supply": 16},
    }
    scenario = written(DRIVEN | {"plant": buoyant, "disturbance": "none", "initial": {}})
    vehicle = SteppedVehicle(scenario, otherwise=3.0)
    for _ in range(75 * 20):
        assert vehicle.step(STILL, 0.05)
    assert vehicle.depth == 3.0
    x = 2 * np.sin(np.arcsin(2 * 112.8 / 114.8 - 1) / 3)  # where it floats, of the radius of its hull
    assert vehicle.state().position[2] + 3.0 == pytest.approx(x * float(vehicle.plant.hull.half_size[0]), abs=2e-3)


def test_the_depth_is_that_of_the_scenario(written):
    """Waves have one already; another one is a contradiction."""
    scenario = written(DRIVEN | {"disturbance": {"kind": "waves", "depth": 2.0}})
    assert SteppedVehicle(scenario, otherwise=0.0).depth == 2.0
    with pytest.raises(BadInput, match=r"`depth` must be that of the scenario's disturbance, 2 m, but is 3 m"):
        SteppedVehicle(scenario, depth=3.0)


def test_specific_force_is_acceleration_without_gravity(vehicle):
    """Against differences of the velocity over a tenth of a millisecond, in a turning, accelerating vehicle."""
    chance = np.random.default_rng(5)
    for _ in range(5):
        given = chance.integers(1300, 1700, 8).astype(float)
        for _ in range(20):
            vehicle.step(given, 0.01)
        before = vehicle.state()
        vehicle.step(given, 1e-4)
        middle = vehicle.state()
        vehicle.step(given, 1e-4)
        acceleration = (vehicle.state().velocity - before.velocity) / 2e-4
        rotation = np.asarray(rotation_from_quaternion(middle.attitude))
        expected = rotation.T @ (acceleration - [0, 0, STANDARD_GRAVITY])
        np.testing.assert_allclose(middle.specific_force, expected, rtol=0, atol=2e-5)


def test_an_accelerometer_at_rest_shows_gravity_upwards(written):
    """Level and in balance, z of FRD is -g; rolled by 90 degrees to starboard, starboard is down."""
    level = {"vehicle": {"kind": "bluerov2_heavy", "parameters": "wu2018"}, "thruster": {"kind": "t200", "supply": 16}}
    scenario = DRIVEN | {"plant": level, "disturbance": "none", "initial": {}}
    force = SteppedVehicle(written(scenario)).state().specific_force
    rising = (112.8 - 114.8) / (11.5 + 14.57)  # weight less buoyancy over mass and added mass of the set
    np.testing.assert_allclose(force, [0, 0, rising - STANDARD_GRAVITY], atol=1e-12)
    rolled = SteppedVehicle(written(scenario | {"initial": {"position": [0, 0, 0, np.pi / 2, 0, 0]}})).state()
    assert rolled.specific_force[1] == pytest.approx(-STANDARD_GRAVITY, abs=0.2)
    assert abs(rolled.specific_force[2]) < 0.1


def test_the_battery_obeys_kirchhoff(written):
    """V_bus = E(q) - R i, P = V_bus i, and each voltage is its duty of the bus."""
    scenario = DRIVEN | {"plant": DRIVEN["plant"] | {"battery": {"kind": "battery", "resistance": 0.05}}}
    vehicle = SteppedVehicle(written(scenario))
    pulses = np.array([1900.0, 1100, 1700, 1300, 1800, 1200, 1650, 1500])
    for _ in range(100):
        vehicle.step(pulses, 0.01)
    x = vehicle.vehicle.state
    state, battery = vehicle.state(), vehicle.plant.power.battery
    assert battery is not None
    bus, current = state.battery
    assert bus == pytest.approx(float(battery.open_circuit_voltage(x.power.charge)) - 0.05 * current, rel=1e-9)
    power = float(vehicle.plant.thruster.electrical_power(x.thrusters, vehicle.vehicle.output.applied).sum())
    assert power == pytest.approx(bus * current, rel=1e-9) and current > 5
    held = vehicle.state()
    vehicle.step(pulses, 1e-9)  # the voltages of the present bus, no longer of that of a frame ago
    np.testing.assert_allclose(
        vehicle.vehicle.output.applied, (pulses - 1500) / 400 * held.battery[0], rtol=0, atol=1e-2
    )


def test_pulses_that_are_not_one_for_each_thruster(vehicle):
    with pytest.raises(BadInput, match=r"`command` must have shape \(8,\), but is of shape \(6,\)"):
        vehicle.step([1500] * 6, 0.01)
    assert vehicle.time == 0


def test_single_precision(written):
    """In the precision of the scenario, as the simulation."""
    scenario = DRIVEN | {"precision": "float32"}
    run = ut.simulate_scenario(scenario).dataset
    vehicle = SteppedVehicle(written(scenario))
    np.testing.assert_array_equal(motions(vehicle, pulses_of(run)[:-1], 0.01), recorded(run))
    assert vehicle.state().position.dtype == np.float32


def test_a_continuous_scenario_is_stepped_too(vehicle, written):
    """Its steps are those of the fourth-order method; the same motion as of the sampled one with the same step."""
    scenario = DRIVEN | {"loop": {"kind": "continuous", "duration": 2.0, "dt": 0.01}}
    scenario["controller"] = "paper"  # a law in continuous time
    scenario["plant"] = {key: value for key, value in DRIVEN["plant"].items() if key != "esc"}
    other = SteppedVehicle(written(scenario))
    for pulses in ([1600.0] * 8, [1450.0] * 8):
        assert other.step(pulses, 0.01) and vehicle.step(pulses, 0.01)
    np.testing.assert_array_equal(other.state().position, vehicle.state().position)


def test_a_state_that_is_not_finite_is_noticed_and_not_kept(vehicle):
    before = vehicle.state()
    vehicle.vehicle.state.nu[...] = [1e200, 0, 0, 0, 0, 0]
    assert not vehicle.step(STILL, 0.01)
    assert vehicle.status is Status.NOT_FINITE
    np.testing.assert_array_equal(vehicle.vehicle.state.nu, [1e200, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(vehicle.state().position, before.position)


@pytest.mark.parametrize(
    "plant, said",
    [
        ("inverted_pendulum", "`plant` must be a vehicle with thrusters"),
        ({"vehicle": "odin", "thruster": {"kind": "commanded_thrust"}}, "`plant.thruster` must take volts"),
        ({"vehicle": "odin", "thruster": "paper_table3"}, "`plant.thruster.supply` must be finite"),
    ],
)
def test_vehicles_that_an_autopilot_cannot_drive(written, plant, said):
    axes = 1 if plant == "inverted_pendulum" else 6
    reference = {"kind": "setpoint", "position": [0] * axes}
    scenario = {"plant": plant, "reference": reference, "loop": {"duration": 1.0, "dt": 0.01}}
    with pytest.raises(BadInput, match=said):
        SteppedVehicle(written(scenario))
