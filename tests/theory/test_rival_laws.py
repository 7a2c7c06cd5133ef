"""What all laws on the common path keep: one path, the batch compiler, tunable gains, and other plants."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.actuation import AbstractAccelerationLaw
from undertow.control.navigation import perfect
from undertow.control.references import setpoint, sine
from undertow.core import catalogue
from undertow.core.param import tuning_ranges
from undertow.physics.disturbances import sinusoid
from undertow.physics.plants import (
    double_integrator,
    hybrid_vehicle,
    inverted_pendulum,
    magnetic_levitation,
    two_link_arm,
)
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy, odin
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

AXIS = double_integrator(1).model()
LAWS = sorted(
    name for name, law in catalogue.names("controllers").items()
    if "model" in law.__annotations__ and name not in ("rcaf", "adrc", "indi", "policy", "replay", "experiment")
    and isinstance(law(AXIS), AbstractAccelerationLaw)
)  # fmt: skip

# Laws whose programs for a vehicle are too large for the batch compiler: they run by XLA.
LARGE = ("nmpc",)


def made(name, plant, **options):
    return catalogue.names("controllers")[name](plant.model(), **options)


def test_laws_are_found():
    assert {"pid", "lqi", "super_twisting", "integral_sliding_mode", "slotine_li", "mrac"} <= set(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_pendulum_stands_and_the_batch_compiler_gives_the_run_of_xla(name):
    """A pole on a cart that the model takes for 30 % shorter: no operation is missing, results are equal to rounding."""
    plant = inverted_pendulum()
    law = catalogue.names("controllers")[name](plant.model(half_length=0.35), sampling_time=0.01)
    loop = ClosedLoop(plant, law, setpoint([0.1]), sinusoid(0.0, 2.0, offset=0.2), perfect())
    options = {"duration": 6.0, "dt": 0.01, "record_every": 10}
    one, other = simd_batch.simulate(loop, **options), sampled.simulate(loop, **options)
    assert int(one.status) == 0 and abs(float(one.signals["error"][-1, 0])) < 2e-3
    np.testing.assert_allclose(one.signals["error"], other.signals["error"], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(one.signals["input"], other.signals["input"], rtol=1e-7, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("make", [bluerov2_heavy, odin])
@pytest.mark.parametrize("name", LAWS)
def test_default_gains_hold_a_vehicle_against_loads(name, make):
    """Loads that change, 50 Hz, limits of 16 V: for 200 s, within twice the error of `pid`."""
    plant = hybrid_vehicle(make(), t200(supply=16.0), ledger=False)
    load = sinusoid([0.2, 0.2, 0.2, 0.1, 0.1, 0.1], 0.8, offset=[0.1, 0.2, 0.1, 0.0, 0.0, 0.1])
    simulate = sampled.simulate if name in LARGE else simd_batch.simulate

    def rms(name):
        law = made(name, plant, sampling_time=0.02)
        loop = ClosedLoop(plant, law, setpoint([1.0, -1.0, 0.5, 0.0, 0.0, 1.0]), load, perfect())
        found = simulate(loop, duration=200.0, dt=0.02, record_every=5)
        assert int(found.status) == 0
        error = np.asarray(found.signals["error"])[-1000:]
        return np.sqrt((error[:, :3] ** 2).sum(1).mean()), np.sqrt((error[:, 3:] ** 2).sum(1).mean())

    assert (np.asarray(rms(name)) < 2.0 * np.asarray(rms("pid")) + 1e-4).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_other_plants_follow(name):
    """Default gains, and for the ball, which falls fast, the sampling time of the rig."""
    arm, ball = two_link_arm(), magnetic_levitation()
    swing = ClosedLoop(arm, made(name, arm, sampling_time=1e-3), sine([1.0, 1.0], [1.0, 2.0]), sinusoid(0.0, 1.0), perfect())  # fmt: skip
    found = simd_batch.simulate(swing, duration=10.0, dt=1e-3, record_every=10)
    assert int(found.status) == 0 and np.abs(found.signals["error"])[500:].max() < 0.01
    float_ = ClosedLoop(ball, made(name, ball, sampling_time=1e-3), setpoint([0.010]), sinusoid(0.0, 1.0), perfect())
    held = simd_batch.simulate(float_, duration=5.0, dt=1e-3, record_every=10, position=[0.0101])
    assert int(held.status) == 0 and abs(float(held.signals["error"][-1, 0])) < 1e-5


@pytest.mark.parametrize("name", [name for name in LAWS if name != "pid"])
def test_declared_gains_may_be_traced(name):
    """As `undertow tune` makes a law: with all tunable gains as traced numbers; the law holds exactly these."""
    make, model = catalogue.names("controllers")[name], double_integrator(2).model()
    law = make(model)
    ranges = tuning_ranges(law)
    assert ranges
    values = {option: np.sqrt(low * high) for option, (low, high) in ranges.items()}

    @eqx.filter_jit
    def gains(values):
        traced = make(model, **values)
        return {option: getattr(traced, option) for option in values}

    for option, value in gains(jax.tree.map(jnp.asarray, values)).items():
        np.testing.assert_allclose(value, values[option])
