"""The sampled loop tends to the continuous one at first order: on halving dt the error ratio tends to 2."""

import jax
import numpy as np
import pytest

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin
from undertow.simulation.loop import continuous, sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

DURATION, RECORD = 1.0, 0.05
STEPS = RECORD / np.array([50, 100, 400])  # 1 ms, 1/2 ms, 1/8 ms
PRECISE = (1e-11, 1e-13)


def on_axes():
    plant = double_integrator(2)
    load = sinusoid(np.array([2.0, 1.0]), np.array([1.0, 5.0]))
    return ClosedLoop(
        plant, rcaf(plant.model(), preset="paper", sets=3), setpoint(np.array([0.2, 0.3])), load, perfect()
    )


def on_odin():
    plant = hybrid_vehicle(odin(), paper_table3("ideal"))
    goal = setpoint(np.array([0.2, 0.3, -0.2, 0.1, -0.1, 0.2]))
    load = sinusoid(np.array([2.0, 1.0, 3.0, 1.0, 0.5, 1.0]), np.array([1.0, 5.0, 2.0, 3.0, 7.0, 4.0]))
    return ClosedLoop(plant, rcaf(plant.model(), preset="paper", sets=3), goal, load, perfect())


@pytest.fixture(
    scope="module",
    params=[pytest.param(on_axes, marks=pytest.mark.full), pytest.param(on_odin, marks=pytest.mark.slow)],
)
def loop(request):
    return request.param()


@pytest.fixture(scope="module")
def truth(loop):
    """The loop as one differential equation, all but exactly."""
    found = continuous.simulate(loop, duration=DURATION, record_step=RECORD, tolerances=PRECISE)
    assert int(found.status) == 0
    return found


def test_first_order(loop, truth):
    def gaps(dt):
        outcome = sampled.simulate(loop, duration=DURATION, dt=dt, record_every=round(RECORD / dt))
        assert int(outcome.status) == 0
        np.testing.assert_allclose(outcome.time, truth.time, atol=1e-12)
        names = ("position", "velocity", "estimate", "predicted_velocity")
        pairs = [(outcome.signals[name], truth.signals[name]) for name in names]
        return np.array([float(np.abs(np.asarray(a) - np.asarray(b)).max()) for a, b in pairs])

    errors = np.stack([gaps(dt) for dt in STEPS])
    halved, quartered = errors[0] / errors[1], np.sqrt(errors[1] / errors[2])
    assert (np.abs(quartered - 2) < 0.1).all(), quartered
    assert (np.abs(quartered - 2) <= np.abs(halved - 2) + 0.02).all(), (halved, quartered)
    assert (errors[2] < errors[0] / 6).all(), errors


def test_run_twice_same_bits(loop, truth):
    once, again = (sampled.simulate(loop, duration=DURATION, dt=STEPS[0], record_every=50) for _ in range(2))
    repeated = continuous.simulate(loop, duration=DURATION, record_step=RECORD, tolerances=PRECISE)
    for pair in ((once, again), (truth, repeated)):
        for one, other in zip(*map(jax.tree.leaves, pair), strict=True):
            np.testing.assert_array_equal(np.asarray(one), np.asarray(other))


def test_fixed_and_adaptive_steps_agree(loop, truth):
    """Two ways to the same answer: the fixed-step ODE converges to the adaptive one at fourth order."""
    errors = []
    for dt in (RECORD / 20, RECORD / 40):
        fixed = continuous.simulate(loop, duration=DURATION, record_step=RECORD, dt=dt)
        errors.append(np.abs(np.asarray(fixed.signals["position"] - truth.signals["position"])).max())
    assert errors[1] < 1e-7
    assert errors[0] / errors[1] > 2**3.5
