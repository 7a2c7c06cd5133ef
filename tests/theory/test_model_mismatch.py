"""Preset `robust` on BlueROV2 Heavy in current and waves, with actuators, delays and noise that it does not know of.

The KTH-like case (a first-order lag of nominally 0.1 s that is 0.03 to 0.3 s), a motor of 0.15 s taken for one of
0.05 s, and what is not modelled at all: 20 and 40 ms of delay, and 1 cm/s of velocity noise.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import pid
from undertow.control.controllers.presets.robust import robust
from undertow.control.navigation import perfect, white_noise
from undertow.control.references import setpoint
from undertow.core.contracts import AbstractNavigation
from undertow.physics.disturbances import current, sinusoid, waves
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import first_order, t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

DT, GOAL = 0.01, [2.0, 1.0, 1.0, 0.0, 0.0, 0.5]  # s; m, rad
SEA = SumOfDisturbances((current([0.3, 0.2, 0.0]), waves(height=0.5, period=5.0)))


class Late(AbstractNavigation):
    """A perfect sensor whose measurements come some sampling times late."""

    steps: int = eqx.field(static=True)
    smooth: bool = eqx.field(static=True, default=False)

    def realize(self, key):
        return ()

    def init(self, path, truth):
        return jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (self.steps, *leaf.shape)), truth)

    def measure(self, path, state, t, truth):
        held = jax.tree.map(lambda old, new: jnp.concatenate([old[1:], new[None]]), state, truth)
        return jax.tree.map(lambda leaf: leaf[0], state), held


def lagged(lag):
    return first_order(4.0, lag, supply=16.0)


def motor(lag):
    """T200 whose rotor is heavier or lighter, so that its lag at half speed is so many seconds."""
    thruster = t200()
    inertia = thruster.motor.rotor_inertia * lag / 0.1001
    return eqx.tree_at(lambda one: one.motor.rotor_inertia, thruster, inertia)


@eqx.filter_jit
def flown(loop):
    run = sampled.simulate(loop, duration=30.0, dt=DT, record_every=5, position=[0.0] * 6)
    late = run.signals
    half = late["error"].shape[0] // 2
    swings = jnp.abs(jnp.diff(late["input"][half:], axis=0)).mean() / (5 * DT)
    return run.status, jnp.sqrt((late["error"][half:] ** 2).mean()), swings


def error(thruster, nominal, make=robust, navigation=None):
    """Rms error over the second half, m and rad; it must have lasted, and not swing (V/s)."""
    plant = hybrid_vehicle(bluerov2_heavy(), thruster, ledger=False)
    law = make(plant.model(rate_term=True, thruster=nominal), sampling_time=DT)
    status, rms, swings = flown(ClosedLoop(plant, law, setpoint(GOAL, settling=8.0), SEA, navigation or perfect()))
    assert int(status) == 0
    return float(rms), float(swings)


@pytest.mark.slow
@pytest.mark.parametrize("make", [lagged, motor])
def test_a_lag_that_is_wrong_by_three_costs_little(make):
    """At most three times the error of the right nominal lag, and no limit cycle: the thrusters vary as they must."""
    cases = ((0.1, 0.03), (0.1, 0.3)) if make is lagged else ((0.05, 0.15),)
    for nominal, true in cases:
        right, needed = error(make(true), make(true))
        wrong, swings = error(make(true), make(nominal))
        assumed, _ = error(make(nominal), make(nominal))
        print(
            f"{make.__name__} {nominal} s taken for {true} s: {wrong:.3g}, right {right:.3g}, as assumed {assumed:.3g}"
        )
        assert wrong < 3 * right and wrong < 3 * assumed
        assert swings < 2 * needed + 1.0


# Noise by itself is that of test_noise_gain.
@pytest.mark.parametrize(
    ("navigation", "known"),
    [(Late(2), 0.0), (Late(4), 0.02), pytest.param(white_noise(0.0, 0.01), 0.0, marks=pytest.mark.slow)],
    ids=["delay", "longer delay", "noise"],
)
def test_delay_and_noise_on_independent_axes(navigation, known):
    """20 ms of delay beyond what is known, 1 cm/s of noise: `robust` keeps ahead of a PID of the same rule."""

    def error(make, navigation):
        plant = double_integrator(2)
        law = make(plant.model(), sampling_time=DT, delay=known)
        loop = ClosedLoop(plant, law, setpoint([2.0, 1.0]), sinusoid([0.3, 0.5], [1.3, 0.7]), navigation)
        run = sampled.simulate(loop, duration=30.0, dt=DT, record_every=5, method="euler")
        assert int(run.status) == 0
        return float(np.sqrt((np.asarray(run.signals["error"])[300:] ** 2).mean()))

    own, other, exact = error(robust, navigation), error(pid, navigation), error(robust, perfect())
    print(f"{type(navigation).__name__}: robust {own:.3g}, pid {other:.3g}, robust without {exact:.3g}")
    assert own < other and own < 3 * exact


@pytest.mark.slow
def test_delay_and_noise_that_nobody_tells_of():
    """40 ms of delay that no law knows of, 1 cm/s of noise: `robust` keeps ahead of a PID of the same rule."""
    for navigation in (Late(4), white_noise(0.0, 0.01)):
        own, _ = error(t200(), None, robust, navigation)
        other, _ = error(t200(), None, pid, navigation)
        exact, _ = error(t200(), None, robust)
        print(f"{type(navigation).__name__}: robust {own:.3g}, pid {other:.3g}, robust without {exact:.3g}")
        assert own < other and own < 3 * exact
