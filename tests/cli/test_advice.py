"""Advice is true, and the shipped scenarios, which mean what they say, get none of it."""

import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_plausible_mistakes import EXAMPLES, PARTS

import undertow as ut
from undertow.control.navigation.drift import drift_advice, drifts
from undertow.control.navigation.observer import observer
from undertow.core.contracts import Pose
from undertow.core.measurement import BODY_OUTPUTS, measurement_of_outputs
from undertow.paper import ablations
from undertow.physics.sensors import compass, depth, dvl, imu, position_fix
from undertow.physics.thrusters import commanded_thrust, t200
from undertow.scenario.attainable_speed import held_speed, top_speed
from undertow.scenario.build import build
from undertow.scenario.plausibility import plausibility
from undertow.scenario.reading import read
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.studies.campaign.campaign_schema import read_campaign
from undertow.studies.campaign.trials import trials

SCENARIOS = [path for path in sorted(EXAMPLES.glob("*.yaml")) if path.stem != "my_rov"]
ABLATIONS = sorted(next(iter(map(type(EXAMPLES), ablations.__path__))).glob("a*_*.yaml"))
QUICK = {"controller": {"kind": "pid", "frequency": 1.0}, "navigation": "perfect", "model": {}}


def said_of(text):
    """What is said of the plant, the reference and the disturbance of a scenario, whatever its controller is."""
    loop = {key: value for key, value in text.data.get("loop", {}).items() if key != "kind"}
    built = build(text._replace(data=text.data | QUICK | {"loop": loop}), PARTS)
    return plausibility(built.closed_loop, built.scenario.loop.duration, built.scenario.initial.position)


@pytest.mark.full
@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_examples_get_no_advice(path):
    assert said_of(read(path)) == ()


@pytest.mark.slow
@pytest.mark.parametrize("path", ABLATIONS, ids=lambda path: path.stem)
def test_scenarios_of_the_reproduction_get_no_advice(path):
    several = trials(*read_campaign(path))
    for combination in range(len(several.combinations)):
        assert said_of(several.scenario._replace(data=several.data(combination))) == ()


@pytest.mark.full
def test_top_speed_of_one_thruster_is_where_its_force_balances_linear_drag():
    odin = ut.vehicles.odin()
    plain = eqx.tree_at(lambda v: (v.quadratic_damping, v.buoyancy), odin, (np.zeros((6, 6)), odin.weight))
    plain = eqx.tree_at(lambda v: v.linear_damping, plain, 20.0 * np.eye(6))
    plant = ut.HybridVehicle(
        plain.with_thrusters([1]), commanded_thrust(thrust_forward_max=30.0, thrust_reverse_max=20.0)
    )
    assert top_speed(plant) == pytest.approx(30.0 / 20.0, rel=2e-3)
    column = np.asarray(plant.thruster_matrix)[:, 0]
    share = 20.0 * column[0] / (column @ column)  # of the thrust per speed, N s/m: moments are left to the vehicle
    for speed, held in ((4.0, 20.0 / share), (-4.0, 30.0 / share), (1.2, 1.2)):
        assert held_speed(plant, np.zeros(6), np.array([speed, 0.0, 0.0])) == pytest.approx(held, abs=0.041)
    heavier = eqx.tree_at(lambda p: p.body.weight, plant, plant.body.weight + 5.0)  # it may also sink
    assert 30.0 / 20.0 < top_speed(heavier) <= 35.0 / 20.0 * (1 + 1e-9)


@pytest.mark.full
@pytest.mark.parametrize(
    ("reference", "start", "distance"),
    [
        (ut.references.circle(radius=2.0, depth=3.0), None, "3 m"),
        (ut.references.circle(radius=2.0, depth=3.0), [0.0, 0.0, 1.9, 0.0, 0.0, 0.0], "1.1 m"),
        (ut.references.circle(radius=2.0, depth=3.0), [0.0, 0.0, 2.1, 0.0, 0.0, 0.0], ""),
        (ut.references.setpoint([0, 0, 3, 0, 0, 0]), None, ""),  # a step, which is meant
        (ut.references.setpoint([0, 0, 3, 0, 0, 0], settling=10.0), None, ""),  # begins at the vehicle
        (ut.references.setpoint([0, 0, 3, 0, 0, 0], settling=10.0, start=[4, 0, 3, 0, 0, 0]), None, "5 m"),
    ],
    ids=str,
)
@pytest.mark.parametrize("thruster", [ut.thrusters.t200(), ut.thrusters.paper_table3()], ids=["limited", "unlimited"])
def test_a_path_that_begins_more_than_1_m_from_the_vehicle(reference, start, distance, thruster):
    plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), thruster)
    law = ut.controllers.pid(plant.model(), frequency=1.0)
    loop = ClosedLoop(plant, law, reference, ut.disturbances.none(), ut.navigation.perfect()).starting_at(start)
    said = [one for one in plausibility(loop, 40.0, start) if "begins" in one.says]
    assert [one.says.startswith(f"`reference` begins {distance} from the vehicle: at ") for one in said] == (
        [True] if distance else []
    )


def advice_in(disturbance, navigation=None, reference=None):
    """What is said of a BlueROV2 Heavy that keeps its place 4 m below the surface, or follows another reference."""
    plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), t200())
    law = ut.controllers.pid(plant.model(), frequency=1.0)
    target = reference or ut.references.setpoint([0, 0, 1, 0, 0, 0])
    loop = ClosedLoop(plant, law, target, disturbance, navigation or ut.navigation.perfect())
    return [one.says for one in plausibility(loop, 60.0, [0, 0, 1, 0, 0, 0])]


@pytest.mark.full
def test_waves_are_too_high_for_the_share_of_the_time_that_a_sea_moves_faster_than_the_thrusters():
    assert not advice_in(ut.disturbances.waves(height=2.0, heading=0.4))
    (sentence,) = advice_in(ut.disturbances.waves(height=3.0, heading=0.4))
    share, held = map(
        float, re.fullmatch(r"for (\d+) % .* than the ([\d.]+) m/s .* depth of 4 m: .*", sentence).groups()
    )
    sea = ut.disturbances.waves(height=3.0, heading=0.4)
    pose = Pose(jnp.array([0.0, 0.0, 1.0]), jnp.eye(3), jnp.zeros(3))
    still = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), t200()).no_load()

    def speeds(key):
        realization = sea.realize(key)
        flow = lambda t: sea.at(realization, t, pose, still).water.velocity
        return jnp.linalg.norm(jax.lax.map(flow, jnp.linspace(0.0, 100.0, 50)), axis=-1)

    sampled = np.asarray(jax.jit(jax.vmap(speeds))(jax.random.split(jax.random.PRNGKey(0), 200)))
    assert 100 * (sampled > held).mean() == pytest.approx(share, abs=1.5)
    at_rest = ut.references.circle(radius=0.1, depth=1.0)  # moves: whether it is carried along depends on its phase
    assert not any("waves" in one for one in advice_in(ut.disturbances.waves(height=3.0), reference=at_rest))


@pytest.mark.full
@pytest.mark.parametrize(("delay", "off"), [(0.05, ""), (0.5, "20 cm")])
def test_a_late_position_is_off_by_speed_times_delay(delay, off):
    moving = ut.references.circle(radius=1.0, depth=1.0, period=2 * np.pi / 0.4)
    said = advice_in(ut.disturbances.none(), ut.navigation.degraded(delay=delay, period=0.01), moving)
    late = [one for one in said if one.startswith(f"positions come {delay:g} s late")]
    assert [f"by up to {off}:" in one for one in late] == ([True] if off else [])


@pytest.mark.full
def test_top_speed_is_unknown_without_limits():
    assert top_speed(ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3())) == np.inf
    assert np.isfinite(top_speed(ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), t200())))


def test_drift_of_a_heading_is_that_of_the_integrated_rate():
    sensors = [imu(rate_noise=2e-3, rate_bias=1e-4, period=0.01), dvl(), depth(), position_fix()]
    expected = np.hypot(2e-3 * np.sqrt(0.01 * 100.0), 1e-4 * 100.0)
    assert drifts(sensors, 0.3, 100.0) == {"yaw": pytest.approx(expected)}
    assert not drifts([*sensors, compass()], 0.3, 100.0) and not drift_advice([*sensors, compass()], 0.3, 100.0)


def test_drift_of_a_position_without_any_velocity_is_that_of_the_twice_integrated_acceleration():
    sensors = [imu(angle_noise=0.0, force_noise=0.02, force_bias=1e-3), depth(), compass()]
    expected = np.hypot(0.02 * np.sqrt(0.01 * 60.0**3 / 3), 1e-3 * 60.0**2 / 2)
    assert drifts(sensors, 0.3, 60.0) == {"north and east": pytest.approx(expected)}


def test_nothing_is_said_of_sensors_that_do_not_say_what_they_measure():
    class Unsaid(type(compass())):
        fixes = None

    assert not drifts([imu(), Unsaid(compass().sampling)], 0.3, 60.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "sensors",
    [
        [imu(), dvl(resolution=0.0), depth(), compass()],
        [imu(), depth(), compass()],
        [imu(), position_fix(), compass()],
        [imu(), dvl(), depth(), position_fix()],
        [imu(angle_bias=2e-3), dvl(bias=2e-3, resolution=0.0), depth(), compass()],
    ],
    ids=["dead reckoning", "inertial", "inertial depth", "heading", "biases"],
)
def test_drift_is_that_of_the_observer(sensors):
    """After 60 s of rest, over 64 seeds, whose standard deviation is known to 9 %; without a bias to 3 sigma."""
    navigation, truth = observer(sensors), measurement_of_outputs(jnp.zeros(6), jnp.zeros(6), None)

    def error(key):
        path = navigation.realize(key)
        step = lambda state, k: (navigation.measure(path, state, 0.01 * k, truth)[1], None)
        last = jax.lax.scan(step, navigation.init(path, truth), jnp.arange(6000.0))[0]
        return navigation.measure(path, last, jnp.asarray(60.0), truth)[0].position

    errors = np.asarray(jax.jit(jax.vmap(error))(jax.random.split(jax.random.PRNGKey(0), 64)))
    rms = dict(zip(BODY_OUTPUTS, np.sqrt((errors**2).mean(axis=0)), strict=True))
    for what, drift in drifts(sensors, 0.3, 60.0).items():
        for output in what.split(" and "):
            assert rms[output] == pytest.approx(drift, rel=0.27)
