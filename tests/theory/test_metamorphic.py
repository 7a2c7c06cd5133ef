"""I30, I31: a fixed point stays, double the load doubles the answer, time may be shifted, axes do not meet."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractDisturbance
from undertow.physics.disturbances.none import none
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin
from undertow.simulation.loop import continuous, sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

POSE = np.array([1.0, -2.0, 3.0, 0.3, -0.4, 2.0])


class Stairs(AbstractDisturbance):
    """Steps of 1/8 s, the first at `start`; zero before."""

    values: Float[Array, " steps"]
    start: Float[Array, ""]

    def realize(self, key):
        return ()

    def at(self, path, t, place, calm):
        index = jnp.floor((t - self.start) * 8).astype(int)
        value = jnp.where(index >= 0, self.values[jnp.clip(index, 0, self.values.size - 1)], 0.0)
        return calm._replace(acceleration=calm.acceleration + value)

    def jumps(self, duration):
        return ()


def swimmer(disturbance):
    """ODIN with ideal thrusters at a pose away from the origin; the model is exact."""
    plant = hybrid_vehicle(odin(), paper_table3("ideal"))
    law = rcaf(plant.model(), preset="paper", sets=3)
    return ClosedLoop(plant, law, setpoint(POSE), disturbance, perfect())


def test_fixed_point_stays_for_a_hundred_seconds():
    outcome = sampled.simulate(
        swimmer(none()), duration=100.0, dt=2e-3, position=POSE, record_every=1000, method="euler"
    )
    assert int(outcome.status) == 0
    samples = outcome.signals
    for name in ("error", "velocity", "estimate", "modelling_error"):
        assert np.abs(np.asarray(samples[name])).max() <= 1e-12, name


@pytest.mark.slow
def test_axes_do_not_meet():
    """Disturb one axis: the others stay. Negative control: disturb all, and they do not."""
    for axis in range(6):
        load = sinusoid(2.0 * np.eye(6)[axis], 3.0)
        outcome = continuous.simulate(swimmer(load), duration=0.5, record_step=0.05, position=POSE)
        moved = np.abs(np.asarray(outcome.signals["error"])).max(0)
        assert np.delete(moved, axis).max() <= 1e-9, (axis, moved)
        assert moved[axis] > 1e-6


@pytest.mark.parametrize("factor", [2.0])
def test_doubling_a_small_load_doubles_the_answer(rails, factor):
    loads = np.array([0.2, 0.2 * factor])
    loop = rails(2, disturbance=sinusoid(loads, 10.0, offset=loads))
    samples = jax.tree.map(np.asarray, sampled.simulate(loop, duration=4.0, record_every=1).signals)
    for series in (samples["estimate"] - samples["uncertainty"], samples["error"]):
        gap = np.abs(series[:, 1] - factor * series[:, 0]).max()
        assert gap <= 0.01 * np.abs(series[:, 1]).max()
    d_til = samples["estimate"] - samples["uncertainty"]
    assert np.abs(d_til[:, 1] - 2.5 * d_til[:, 0]).max() > 0.01 * np.abs(d_til[:, 1]).max()


def test_time_shift_shifts_every_bit(rails):
    """Ticks of 2^-10 s and shifts of whole steps: the clock adds without rounding."""
    values = np.random.default_rng(3).normal(0.0, 3.0, 16)
    step, shift = 2.0**-10, 512

    def run(start, steps):
        loop = rails(1, disturbance=Stairs(jnp.asarray(values), jnp.asarray(start)))
        return sampled.simulate(loop, duration=steps * step, dt=step, record_every=1).signals

    early, late = run(0.0, 2048), run(shift * step, 2048)
    for series, shifted in zip(jax.tree.leaves(early), jax.tree.leaves(late), strict=True):
        later = np.asarray(shifted)[shift:]
        np.testing.assert_array_equal(np.asarray(series)[: len(later)], later)
    assert np.abs(np.asarray(early["position"])).max() > 0
