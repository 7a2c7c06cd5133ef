"""Rival laws, modified adaptation, degraded measurements and loss of thrust, as parts of scenarios."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis.small_signal import gains
from undertow.control.controllers import adrc, indi
from undertow.control.controllers.presets.paper import paper
from undertow.control.controllers.presets.robust import robust
from undertow.control.navigation import degraded
from undertow.control.references import setpoint
from undertow.core.contracts import Measurement
from undertow.core.errors import BadInput
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.scenario.build import build
from undertow.simulation.loop import sampled

LOAD = {"kind": "random_suite", "amplitude": 0.5, "step": 0.3}

# What a linear law needs to do in small signal what Table 1 does: section 3.1 of the theory.
TABLE1 = gains(paper(double_integrator(1).model()))
SAME = {
    "bandwidth": TABLE1.b2**0.5,
    "damping": TABLE1.pole / (2 * TABLE1.b2**0.5),
    "feedback": [TABLE1.stiffness, TABLE1.damping],
}


def run(controller, goal=0.0, duration=0.4, limit=None, load=LOAD, **keys):
    plant = {"kind": "double_integrator", "axes": 6} | ({} if limit is None else {"limit": limit})
    data = {"plant": plant, "controller": controller, "reference": {"kind": "setpoint", "position": [goal] * 6}}
    loop = build(data | {"disturbance": load, "loop": {"kind": "sampled", "duration": duration}} | keys).closed_loop
    outcome = sampled.simulate(loop, duration=duration, record_every=10, key=jax.random.PRNGKey(0))
    assert int(outcome.status) == 0
    return outcome.signals


STILL = {"reference": {"kind": "setpoint", "position": [0.0] * 6}}
AXES = {"plant": {"kind": "double_integrator", "axes": 6}, "disturbance": "none", **STILL}


def rcaf(**options):
    return {"kind": "paper", **options}


@pytest.mark.full
def test_adrc_and_indi_of_one_bandwidth_are_one_law():
    """d_hat = H (x_ddot - F - G u) either way; the two programs differ in the last digits only."""
    observer, inversion = run({"kind": "adrc", **SAME}), run({"kind": "indi", **SAME})
    np.testing.assert_allclose(inversion["error"], observer["error"], atol=1e-12)
    np.testing.assert_allclose(inversion["estimate"], observer["estimate"], atol=1e-9)
    table_1 = run("paper")["error"]  # in small signal the same again, but for the share of s in the adaptation
    assert float(jnp.abs(observer["error"] - table_1).max()) < 0.03 * float(jnp.abs(table_1).max())


@pytest.mark.full
@pytest.mark.parametrize("kind", ["adrc", "indi"])
def test_a_linear_law_removes_a_constant_load(kind):
    """At rest d_hat = -(what disturbs), so that the error is zero, whatever the gains."""
    push = {
        "kind": "sinusoid",
        "amplitude": [0.0] * 6,
        "frequency": [1.0] * 6,
        "offset": [3.0, -2.0, 1.0, 0.5, 0.0, -4.0],
    }
    found = run({"kind": kind, "bandwidth": 30.0, "feedback": [16.0, 8.0]}, duration=4.0, load=push)
    np.testing.assert_allclose(found["estimate"][-1], [3.0, -2.0, 1.0, 0.5, 0.0, -4.0], rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(found["error"][-1], 0.0, atol=1e-4)


@pytest.mark.full
@pytest.mark.parametrize("make", [adrc, indi])
def test_default_gains_are_those_of_the_rule_of_preset_robust(make):
    """Bandwidth, feedback, actuator loop and filter of jumps of a vehicle with lagged thrusters and noisy velocity."""
    model = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0)).model()
    where = {"sampling_time": 0.01, "velocity_noise": 0.01}
    law, like = make(model, **where), robust(model, **where)
    np.testing.assert_array_equal(law.bandwidth, like.estimator.bandwidth)
    np.testing.assert_array_equal(law.feedback, like.feedback)
    np.testing.assert_array_equal(law.actuation.actuator_rate, like.actuator_rate)
    np.testing.assert_array_equal(law.actuation.filter.frequency, like.filter.frequency)
    assert make(model, feedback=(1.0, 2.0), **where).actuation.filter is None
    with pytest.raises(BadInput, match="tracking"):
        make(model, feedback=(1.0, 2.0), tracking=1.0)


@pytest.mark.full
@pytest.mark.parametrize("kind", ["adrc", "indi"])
def test_a_linear_law_does_not_wind_up(kind):
    """The estimate of a constant load is the same at the limits: it uses what was applied."""
    push = {"kind": "sinusoid", "amplitude": [0.0] * 6, "frequency": [1.0] * 6, "offset": [0.7] * 6}
    law = {"kind": kind, "bandwidth": 30.0, "feedback": [16.0, 8.0]}
    limited, free = (run(law, goal=2.0, duration=4.0, limit=limit, load=push)["estimate"] for limit in (2.0, None))
    np.testing.assert_allclose(limited, free, atol=1e-9)


@pytest.mark.full
@pytest.mark.parametrize("kind", ["adrc", "indi"])
@pytest.mark.parametrize(
    ("key", "value"), [("bandwidth", 0.0), ("damping", -1.0), ("feedback", [-1.0, 2.0]), ("bandwidth", [1.0, 2.0])]
)
def test_gains_that_no_linear_law_can_have(kind, key, value):
    with pytest.raises(BadInput, match=key):
        build(AXES | {"controller": {"kind": kind, key: value}})


@pytest.mark.full
def test_identification_fed_with_the_command_differs_only_where_limits_bind():
    plain, commanded = run(rcaf()), run(rcaf(identification_input="commanded"))
    np.testing.assert_array_equal(commanded["error"], plain["error"])
    applied = run(rcaf(), goal=2.0, limit=1.0)
    wound_up = run(rcaf(identification_input="commanded"), goal=2.0, limit=1.0)
    assert float(wound_up["weights_peak"].max()) > 10 * float(applied["weights_peak"].max())


@pytest.mark.full
def test_a_modification_of_nothing_is_the_law_itself():
    assert build(AXES | {"controller": rcaf(leakage=0.0)}).closed_loop.controller.modification is None
    small = run(rcaf(leakage=1e-300))
    np.testing.assert_array_equal(small["weights"], run(rcaf())["weights"])


@pytest.mark.full
def test_leakage_is_a_decay_of_the_weights():
    """Without an error theta_dot = -gamma kappa theta; one step of Euler's method multiplies by 1 - dt gamma kappa."""
    law = paper(double_integrator(2).model(), leakage=0.01, e_modification=0.5, sets=3)
    y, wanted = Measurement(jnp.zeros(2), jnp.zeros(2)), setpoint([0.0, 0.0]).at(jnp.zeros(()))
    z = law.init(y, wanted)._replace(weights=jnp.array([[1.0, -1.0, 2.0], [0.5, 0.0, -0.5]]))
    after = law.advance(z, y, wanted, jnp.zeros(2), 1e-3)
    np.testing.assert_allclose(after.weights, z.weights * (1 - 1e-3 * 100 * 0.01), rtol=1e-12)
    off = z._replace(predicted_velocity=jnp.array([0.2, -0.2]))
    plain = paper(double_integrator(2).model(), sets=3)
    learnt = plain.advance(off, y, wanted, jnp.zeros(2), 1e-3).weights - z.weights
    both = law.advance(off, y, wanted, jnp.zeros(2), 1e-3).weights
    np.testing.assert_allclose(both, z.weights * (1 - 1e-3 * 100 * (0.01 + 0.5 * 0.2)) + learnt, rtol=1e-12)


@pytest.mark.full
def test_nothing_is_learnt_inside_the_dead_zone():
    assert not run(rcaf(dead_zone=1e3))["weights"].any()
    inside, outside = run(rcaf(dead_zone=1e-12))["weights"][-1], run(rcaf())["weights"][-1]
    np.testing.assert_array_equal(inside, outside)


def readings(sensor, steps=12, dt=1e-3):
    """What a sensor makes of velocity 0.1, 0.2, ... and position 1, 2, ... on two axes."""
    found = _readings(sensor, jnp.arange(steps, dtype=float), jnp.asarray(dt))
    return np.stack([found.position[:, 0], found.velocity[:, 0]], 1)


@eqx.filter_jit
def _readings(sensor, steps, dt):
    path, both = sensor.realize(jax.random.PRNGKey(3)), jnp.ones(2)

    def step(state, k):
        y, after = sensor.measure(path, state, k * dt, Measurement((1 + k) * both, 0.1 * (1 + k) * both))
        return after, Measurement(y.position, y.velocity)

    return jax.lax.scan(step, sensor.init(path, Measurement(both, 0.1 * both)), steps)[1]


def test_a_sensor_with_nothing_wrong_gives_the_truth():
    found = readings(degraded())
    np.testing.assert_allclose(found, np.outer(np.arange(1, 13), [1.0, 0.1]))


def test_a_late_sensor_gives_what_was():
    found = readings(degraded(delay=3e-3))
    np.testing.assert_array_equal(found[:, 0], [1, 1, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9])


def test_a_slow_sensor_repeats_itself():
    np.testing.assert_array_equal(readings(degraded(period=5e-3))[:, 0], [1] * 5 + [6] * 5 + [11] * 2)


def test_resolution_and_bias():
    found = readings(degraded(velocity_resolution=0.25))
    np.testing.assert_allclose(found[:, 1] / 0.25, np.round(0.1 * np.arange(1, 13) / 0.25))
    np.testing.assert_allclose(found[:, 0], np.arange(1, 13))
    biased = readings(degraded(velocity_bias=0.5, position_bias=-1.0))
    np.testing.assert_allclose(biased, np.outer(np.arange(1, 13), [1.0, 0.1]) + [-1.0, 0.5])


def test_noise_has_its_size_and_a_law_is_told_of_it():
    sensor = degraded(velocity_noise=0.01)
    found = readings(sensor, steps=400)
    assert np.std(found[:, 1] - 0.1 * np.arange(1, 401)) == pytest.approx(0.01, rel=0.1)
    np.testing.assert_allclose(found[:, 0], np.arange(1, 401))
    assert float(sensor.velocity_noise(1e-3)) == pytest.approx(0.01)
    slow = degraded(velocity_noise=0.01, period=0.1)  # as many readings in 10 s, as much information
    assert float(slow.velocity_noise(1e-3)) == pytest.approx(0.1)


@pytest.mark.full
def test_as_many_thrusters_fail_as_there_are_entries():
    entry = {"target": "thruster", "number": "random", "mode": "fraction", "severity": 0.25, "onset": 2.0}
    odin = {"kind": "hybrid_vehicle", "vehicle": "odin"}
    loop = build(STILL | {"plant": odin, "faults": [entry] * 3}).closed_loop
    pose, no_load = loop.plant.pose(loop.plant.initial_state()), loop.plant.no_load()

    @jax.jit
    def shares(key):
        at = lambda t: loop.faults.load(loop.faults.realize(key), t, pose, no_load).scaling.thrust
        return at(1.99), at(2.0)

    before, after = jax.vmap(shares)(jax.random.split(jax.random.PRNGKey(5), 40))
    assert (before == 1.0).all() and (np.sort(after) == [0.25] * 3 + [1.0] * 5).all()
    assert (after < 1).any(0).all(), "all thrusters have their turn"


@pytest.mark.full
def test_a_thruster_without_thrust_is_no_thruster():
    """One thruster of ODIN off is the vehicle without it."""
    odin = {"kind": "hybrid_vehicle", "vehicle": "odin"}
    loss = {"target": "thruster 3", "mode": "fraction", "severity": 0, "onset": 2.0}
    loop = build(STILL | {"plant": odin, "faults": [loss]}).closed_loop
    without = build(STILL | {"plant": odin | {"thrusters": [1, 2, 4, 5, 6, 7, 8]}}).closed_loop.plant
    plant, volts = loop.plant, jnp.linspace(3.0, 10.0, 8)
    x, x_without = plant.initial_state(), without.initial_state()
    realization = loop.realize(jax.random.PRNGKey(0))
    at = lambda t: plant.acceleration(t, x, volts, realization.load(t, x))
    np.testing.assert_array_equal(at(1.99), plant.acceleration(0.0, x, volts, plant.no_load()))
    np.testing.assert_allclose(
        at(2.0), without.acceleration(0.0, x_without, jnp.delete(volts, 2), without.no_load()), rtol=1e-12, atol=1e-12
    )
    assert loop.faults.jumps(5.0) == (2.0,)
