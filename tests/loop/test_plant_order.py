"""I33: under a controller of fixed rate the plant is integrated at fourth order, and jumps of the load are met."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractDisturbance
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.plants.inverted_pendulum import inverted_pendulum
from undertow.physics.plants.mechanism import AbstractMechanism
from undertow.physics.plants.two_link_arm import two_link_arm
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin
from undertow.simulation.loop import continuous, sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

GENTLE = {"adaptation": 1.0, "composite": 1.0, "robust_gain": 0.0, "pole": 5.0}  # stable at 20 Hz


class Step(AbstractDisturbance):
    """`size` between `start` and `end`, nothing else; what it says of that is another matter."""

    size: Float[Array, ""]
    start: float = eqx.field(static=True)
    end: float = eqx.field(static=True)
    told: tuple[float, float] | Array | None = None  # times of jumps of which the loop is told; None for the true ones

    def realize(self, key):
        return ()

    def at(self, path, t, place, calm):
        on = (t >= self.start) & (t < self.end)
        return calm._replace(acceleration=calm.acceleration + jnp.where(on, self.size, 0.0))

    def jumps(self, duration):
        return (self.start, self.end) if self.told is None else tuple(self.told)


def rail(disturbance, limit=float("inf"), **gains):
    plant = double_integrator(1, limit)
    return ClosedLoop(
        plant, rcaf(plant.model(), preset="paper", **gains), setpoint(np.zeros(1)), disturbance, perfect()
    )


class Pendulum(AbstractMechanism):
    """x_ddot = -20 sin x + u + d, smooth; a double integrator in everything else."""

    rail: AbstractMechanism
    outputs: tuple[str, ...] = eqx.field(static=True, default=("angle",))
    output_units: tuple[str, ...] = eqx.field(static=True, default=("rad",))
    input_unit: str = eqx.field(static=True, default="rad/s^2")

    def initial_state(self, position=None, velocity=None):
        return self.rail.initial_state(position, velocity)

    def acceleration(self, t, x, u, d):
        return self.rail.acceleration(t, x, u, d) - 20 * jnp.sin(x.position)

    def dynamics(self, t, x, u, d):
        return type(x)(x.velocity, self.acceleration(t, x, u, d))

    def output(self, t, x):
        return self.rail.output(t, x)

    def limits(self):
        return self.rail.limits()

    def power(self, x, u):
        return self.rail.power(x, u)

    def status(self, x):
        return self.rail.status(x)

    def model(self):
        return self.rail.model()


def swinging():
    plant = Pendulum(double_integrator(1))
    law = rcaf(plant.model(), preset="paper", **GENTLE)
    return ClosedLoop(plant, law, setpoint(np.zeros(1)), sinusoid(1.0, 15.0), perfect()), np.ones(1)


def of_plant(plant, velocity):
    """A plant of the catalogue under a law that was told the truth."""
    law = rcaf(plant.model(), preset="paper", **GENTLE)
    n = len(plant.outputs)
    return ClosedLoop(plant, law, setpoint(np.full(n, 0.2)), sinusoid(1.0, 15.0), perfect()), np.full(n, velocity)


def balancing():
    return of_plant(inverted_pendulum(), 1.0)


def reaching():
    return of_plant(two_link_arm(), 1.0)


def swimming():
    """ODIN moving on every axis, so that |nu| nu is smooth."""
    plant = hybrid_vehicle(odin(), paper_table3("ideal"))
    loop = ClosedLoop(
        plant, rcaf(plant.model(), preset="paper", **GENTLE), setpoint(np.full(6, 0.5)), sinusoid(1.0, 15.0), perfect()
    )
    return loop, np.full(6, 0.8)


@pytest.mark.full
@pytest.mark.parametrize(
    "make", [swinging, *(pytest.param(make, marks=pytest.mark.slow) for make in (reaching, balancing, swimming))]
)
def test_fourth_order_in_the_step_of_the_plant(make):
    """1, 2 and 4 steps of RK4 per step; the control rate stays 20 Hz."""
    loop, velocity = make()
    ends = {}
    for substeps in (1, 2, 4):
        outcome = sampled.simulate(loop, duration=0.4, dt=0.05, record_every=0, velocity=velocity, substeps=substeps)
        motion = loop.plant.output(outcome.ended, outcome.final[0])  # a vehicle's state also holds energies, in joules
        ends[substeps] = np.concatenate([motion.position, motion.velocity])
    coarse, fine = np.abs(ends[1] - ends[2]).max(), np.abs(ends[2] - ends[4]).max()
    assert fine > 1e-10, "far above rounding"
    assert 3.8 <= np.log2(coarse / fine) <= 4.6, (coarse, fine)


@pytest.mark.full
def test_a_jump_at_a_tick_is_met_exactly():
    """No input, constant load within a step: the motion is a parabola, and RK4 has it to rounding."""
    outcome = sampled.simulate(
        rail(Step(jnp.asarray(3.0), 0.25, 0.75), limit=0.0), duration=1.0, dt=2.0**-6, record_every=1
    )
    t = np.asarray(outcome.time)
    pushed = np.clip(t - 0.25, 0.0, 0.5)
    exact = 1.5 * pushed**2 + 1.5 * np.clip(t - 0.75, 0.0, None)
    assert np.abs(np.asarray(outcome.signals["position"])[:, 0] - exact).max() < 1e-8
    # Negative control: a jump inside a step is smeared.
    inside = sampled.simulate(
        rail(Step(jnp.asarray(3.0), 0.255, 0.75), limit=0.0), duration=1.0, dt=2.0**-6, record_every=1
    )
    late = np.clip(t - 0.255, 0.0, 0.495)
    smeared = 1.5 * late**2 + 3.0 * 0.495 * np.clip(t - 0.75, 0.0, None)
    assert np.abs(np.asarray(inside.signals["position"])[:, 0] - smeared).max() > 1e-4


@pytest.mark.full
def test_declared_jumps_are_met_by_the_continuous_loop():
    """A pulse of 0.1 ms after a long calm: only an integrator that was told of it sees it."""
    slow = {"adaptation": 0.0, "robust_gain": 0.0, "pole": 1.0, "compensation_gain": 0.0}
    speeds = {}
    for declared, told in ((True, [5.0, 5.0001]), (False, [1.0, 2.0])):
        loop = rail(Step(jnp.asarray(1000.0), 5.0, 5.0001, np.array(told)), **slow)
        outcome = continuous.simulate(loop, duration=5.02, record_step=0.01, tolerances=(1e-8, 1e-9))
        speeds[declared] = float(outcome.signals["velocity"][-1, 0])
    assert 0.09 < speeds[True] < 0.1
    assert abs(speeds[False]) < 1e-6, "negative control: undeclared, it is stepped over"
