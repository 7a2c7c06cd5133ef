"""Decentralised control: each law is as if alone, and laws that work axis by axis are the same in one piece."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis.metrics import measure
from undertow.control.controllers.decentralised import decentralised
from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.white_noise import white_noise
from undertow.control.references.setpoint import setpoint
from undertow.core.actuator_model import DirectActuator, LaggedActuator
from undertow.core.composite_model import composite_model, parts_of
from undertow.core.contracts import Target
from undertow.core.errors import BadInput
from undertow.physics.disturbances.none import none
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.plants.two_link_arm import two_link_arm
from undertow.physics.plants.two_vehicles import two_vehicles
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2 import bluerov2
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

START = np.array([0.0, 0, 0, 0, 0, 0.1, -4.2, 0.3, 0, 0, 0, -0.2])
GOAL = np.array([0.3, -0.2, 0.1, 0, 0, 0.2, -4.5, 0.1, 0.2, 0.1, 0, -0.1])


def paper(model):
    return rcaf(model, preset="paper")


def robust(model):
    return rcaf(model, preset="robust", sampling_time=0.01)


def run(plant, law, goal, start, simulate=simd_batch.simulate, navigation=None):
    loop = ClosedLoop(plant, law, setpoint(goal), none(), navigation or white_noise(0.0, 0.0))
    return simulate(loop, duration=2.0, dt=0.01, position=start, record_every=10), loop


def pair(link="none"):
    return two_vehicles(bluerov2_heavy(), t200(), second_vehicle=bluerov2(), link=link, length=3.5)


@pytest.mark.full
def test_without_a_link_each_run_is_that_of_the_vehicle_alone():
    """Position, input and estimate of both vehicles, which share nothing, to rounding."""
    plant = pair()
    found, _ = run(plant, decentralised(plant.model(), robust), GOAL, START)
    for i, hull in enumerate((bluerov2_heavy(), bluerov2())):
        alone, axes = hybrid_vehicle(hull, t200(), ledger=False), slice(6 * i, 6 * i + 6)
        expected, _ = run(alone, robust(alone.model()), GOAL[axes], START[axes])
        actuators = slice(0, 8) if i == 0 else slice(8, None)
        for name, part in (("position", axes), ("estimate", axes), ("input", actuators)):
            there = np.asarray(expected.signals[name])
            np.testing.assert_allclose(found.signals[name][:, part], there, atol=1e-9 * np.abs(there).max() + 1e-12)


@pytest.mark.full
def test_the_papers_law_is_decentralised_by_itself():
    """Axis by axis, with a model of blocks: one law for 12 axes = a law for each vehicle."""
    plant = pair("tether")
    several, _ = run(plant, decentralised(plant.model(), paper), GOAL, START)
    one, _ = run(plant, rcaf(plant.model(), preset="paper"), GOAL, START)
    for name in ("position", "estimate", "input"):
        np.testing.assert_allclose(several.signals[name], one.signals[name], rtol=1e-7, atol=1e-9)
    assert several.signals["tension"].max() > 1


@pytest.mark.full
def test_laws_see_only_their_own_vehicle():
    """The command of one does not depend on measurement, reference or applied input of the other."""
    plant = pair("tether")
    law = decentralised(plant.model(), paper)
    x = plant.initial_state(jnp.asarray(START), jnp.linspace(-0.2, 0.3, 12))
    y, r = plant.output(0.0, x), Target(jnp.asarray(GOAL), jnp.zeros(12), jnp.zeros(12))
    z, volts = law.init(y, r), jnp.linspace(-3, 3, plant.inputs())

    @jax.jit
    def first(position, velocity, goal, u):
        seen, target = y._replace(position=position, velocity=velocity), r._replace(position=goal)
        after = law.advance(z, seen, target, u, jnp.asarray(0.01))
        return law.command(after, seen, target)[0][:8]

    at = y.position, y.velocity, r.position, volts
    here = first(*at)
    for i, own in enumerate((6, 6, 6, 8)):
        for part, same in ((slice(own, None), True), (slice(0, own), False)):
            changed = first(*(value.at[part].add(0.1) if i == k else value for k, value in enumerate(at)))
            assert np.array_equal(changed, here) == same


@pytest.mark.slow
def test_batch_compiler_runs_it_alike():
    plant = pair("tether")
    law = decentralised(plant.model(), robust)
    noisy = white_noise(1e-3, 1e-3)
    (found, _), (expected, _) = (
        run(plant, law, GOAL, START, way, noisy) for way in (simd_batch.simulate, sampled.simulate)
    )
    for name in ("position", "input", "tension"):
        there = np.asarray(expected.signals[name])
        np.testing.assert_allclose(found.signals[name], there, atol=1e-7 * np.abs(there).max())


@pytest.mark.full
def test_signals_and_metrics_of_all_axes():
    """Those over axes are joined, numbers become one; an rms is over the axes of both vehicles."""
    plant = pair("tether")
    found, loop = run(plant, decentralised(plant.model(), robust), GOAL, START)
    signals = loop.signals()
    assert signals["estimate"].dimensions == ("axis",) and found.signals["estimate"].shape == (21, 12)
    assert signals["attained_share"].dimensions == () and found.signals["attained_share"].shape == (21,)
    largest = np.abs(found.signals["weights"]).max((1, 2))
    np.testing.assert_allclose(found.signals["weights_peak"], largest)
    memory = decentralised(plant.model(), lambda model: rcaf(model, preset="learning")).signals()
    assert memory["memory_variance"].dimensions == ("subsystem", "regressor")
    assert found.signals["weights"].shape[1] == 12
    metrics = measure(found, plant)
    metres = [i for i, unit in enumerate(plant.output_units) if unit == "m"]
    expected = np.sqrt((np.asarray(found.signals["error"])[:, metres] ** 2).mean())
    assert metrics["position_rms"] == pytest.approx(expected) and len(metrics["error_rms_axes"]) == 12
    assert loop.controller.model.coordinates.axes[6:8] == ("surge_2", "sway_2")


@pytest.mark.full
def test_a_plant_of_one_part_has_one_law():
    arm = two_link_arm()
    law = decentralised(arm.model())
    assert len(law.laws) == 1 and law.model is law.laws[0].model
    y = arm.output(0.0, arm.initial_state(jnp.asarray([0.2, 0.1])))
    r = Target(jnp.ones(2), jnp.zeros(2), jnp.zeros(2))
    alone = rcaf(arm.model(), preset="robust")
    np.testing.assert_array_equal(law.command(law.init(y, r), y, r)[0], alone.command(alone.init(y, r), y, r)[0])


def test_composite_of_different_plants():
    """Plants with 2 and 6 outputs: blocks of G, and of all else the numbers of each alone."""
    arm, rov = two_link_arm().model(), hybrid_vehicle(bluerov2_heavy(), t200()).model()
    both = composite_model((arm, rov), (2, 8))
    demanded = np.linspace(1, -1, 8)
    places = slice(0, 2), slice(2, None)

    @jax.jit
    def of_coordinates(position, velocity):
        y = both.coordinates.measurement(position, velocity)
        r = Target(demanded, demanded / 2, demanded / 4)
        own = [
            (one, one.coordinates, one.coordinates.measurement(position[k], velocity[k]), Target(*(a[k] for a in r)), k)
            for one, k in zip((arm, rov), places, strict=True)
        ]
        coordinates = both.coordinates
        joined = {
            "error": tuple(coordinates.tracking_error(y, r)),
            "velocity": coordinates.velocity(y),
            "acceleration": coordinates.acceleration(y, demanded),
            "output_velocity": coordinates.output_velocity(y, demanded),
            "drift": both.dynamics.drift(y),
            "compensated": both.drift_at_target_velocity(y, demanded),
        }
        alone = [
            {
                "error": tuple(c.tracking_error(y, r)),
                "velocity": c.velocity(y),
                "acceleration": c.acceleration(y, demanded[k]),
                "output_velocity": c.output_velocity(y, demanded[k]),
                "drift": one.dynamics.drift(y),
                "compensated": one.drift_at_target_velocity(y, demanded[k]),
            }
            for one, c, y, r, k in own
        ]
        return both.dynamics.gain(y) @ both.dynamics.invert(y, demanded), joined, alone

    attained, joined, alone = of_coordinates(np.linspace(-0.5, 0.7, 8), np.linspace(0.3, -0.2, 8))
    np.testing.assert_allclose(attained, demanded, atol=1e-10)
    for found, *parts in zip(*map(jax.tree.leaves, (joined, *alone)), strict=True):
        np.testing.assert_allclose(found, np.concatenate(parts), rtol=1e-13)
    assert [count for count in parts_of(both)[1]] == [2, 8] and both.coordinates.axes == ()


def test_composite_of_different_actuators():
    """Eight T200 and two actuators with a lag of 0.4 s: every number is that of each alone."""
    lagged = LaggedActuator(DirectActuator(3.0, -2.0, 2.5), 0.4, 2)
    models = hybrid_vehicle(bluerov2_heavy(), t200()).model(), two_link_arm().model()._replace(actuators=lagged)
    parts, both = [one.actuators for one in models], composite_model(models, (8, 2)).actuators
    assert float(both.time_constant()) == 0.4
    unknown = models[1]._replace(actuators=DirectActuator(at_once=False))
    assert composite_model((models[0], unknown), (8, 2)).actuators.time_constant() is None
    u, force = np.linspace(-0.9, 0.9, 10), np.linspace(-20.0, 20.0, 10)
    places = slice(0, 8), slice(8, None)

    @jax.jit
    def steps(u, force):
        def of(one, u, force):
            state = one.update_from_report(one.advance(one.init(), u, 0.05), None)
            rate = jnp.asarray(3.0)
            low, high = (jnp.broadcast_to(end, u.shape) for end in one.range(state, rate))
            return {
                "range": (low, high),
                "force": one.force(state, u),
                "command": one.command(state, force, rate),
                "target": one.target_of(state, u, rate),
                "still": one.quasi_static().force(one.quasi_static().init(), u),
            }

        bandwidths = [one.max_bandwidth(0.05) for one in (both, *parts)]
        return of(both, u, force), [of(one, u[k], force[k]) for one, k in zip(parts, places, strict=True)], bandwidths

    joined, alone, (bandwidth, *own) = steps(u, force)
    for found, *values in zip(*map(jax.tree.leaves, (joined, *alone)), strict=True):
        np.testing.assert_allclose(found, np.concatenate(values), rtol=1e-12)
    assert float(bandwidth) == min(map(float, own)) < max(map(float, own))


def scenario(**changes):
    return {
        "plant": {"kind": "two_vehicles", "vehicle": "bluerov2_heavy", "thruster": "t200"},
        "controller": {"kind": "decentralised", "law": {"kind": "rcaf", "preset": "robust", "tracking": 1.5}},
        "reference": {"kind": "setpoint", "position": GOAL.tolist()},
        "loop": {"dt": 0.01, "duration": 1.0, "record": 0.1},
    } | changes


@pytest.mark.full
def test_scenario_gives_each_law_its_options_and_its_noise():
    noise = np.repeat([0.001, 0.05], 6).tolist()
    built = build(from_data(scenario(navigation={"kind": "white_noise", "velocity": noise})))
    law = built.closed_loop.controller
    quiet, loud = (float(one.actuator_rate) for one in law.laws)
    assert loud < 0.8 * quiet
    again = build(from_data(built.resolved)).closed_loop.controller
    for one, other in zip(again.laws, law.laws, strict=True):
        np.testing.assert_array_equal(one.estimator.bandwidth, other.estimator.bandwidth)
    assert built.resolved["controller"]["law"]["tracking"] == 1.5
    assert built.resolved["controller"]["law"]["sampling_time"] == 0.01


@pytest.mark.full
@pytest.mark.parametrize(
    ("law", "says"),
    [
        (3, "controller.law must be a controller by name"),
        ({"kind": "rcaf", "preset": "robust", "tracking": -1.0}, "controller.law.tracking must be positive"),
        ({"kind": "rcaaf"}, "controller.law.kind must"),
    ],
)
def test_bad_law(law, says):
    with pytest.raises(BadInput) as caught:
        build(from_data(scenario(controller={"kind": "decentralised", "law": law})))
    assert says in str(caught.value).replace("`", "")


def test_number_of_laws():
    plant = pair()
    with pytest.raises(BadInput, match="be one for each of the 2 subsystems"):
        decentralised(plant.model(), [rcaf(parts_of(plant.model())[0][0], preset="paper")])
