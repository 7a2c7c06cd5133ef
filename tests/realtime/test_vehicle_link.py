"""The scenario's own vehicle behind the loop: the bits of a simulation, and times that are no sampling time."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core.contracts import AbstractFaults
from undertow.core.measurement import with_outputs
from undertow.core.numerics.random_keys import numbered
from undertow.outside.realtime.control_loop import RealTimeLoop, Reason
from undertow.outside.realtime.loop_clock import SimulatedClock
from undertow.outside.realtime.vehicle_link import VehicleLink
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.scenario.results.run_scenario import run_scenario

pytestmark = pytest.mark.full

NOISY = {"kind": "white_noise", "position": 0.001, "velocity": 0.01}
PENDULUM = {
    "plant": "inverted_pendulum",
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "initial": {"position": [0.05]},
    "loop": {"duration": 1.0, "dt": 0.001, "record": 0.001},
}


class Keeping(VehicleLink):
    """Keeps what it measured and was sent."""

    def __init__(self, built):
        super().__init__(built)
        self.measured, self.sent, self.announced = [], [], []

    def receive(self, elapsed):
        found = super().receive(elapsed)
        outputs = found.position if self.form is None else np.concatenate([found.position, found.attitude[:3]])
        self.announced.append(found.health)
        self.measured.append((outputs, found.velocity[: len(outputs)]))
        return found

    def send(self, command):
        self.sent.append(command.copy())
        super().send(command)


def run_of(built):
    link = Keeping(built)
    words = {} if link.form is None else {"attitude": "both", "velocity": "both"}
    loop = RealTimeLoop(ut.Autopilot(built, **words), link, SimulatedClock())
    assert loop.run(round(built.scenario.loop.duration / built.scenario.loop.dt)) is Reason.COMPLETED
    return link


@pytest.mark.parametrize("navigation", [NOISY, {"kind": "kalman"}, None])
def test_every_bit_is_that_of_a_simulation(navigation, heavy_data):
    scenario = PENDULUM if navigation is None else heavy_data | {"navigation": navigation}
    link, record = run_of(build(from_data(scenario))), ut.simulate_scenario(scenario).dataset
    assert link.backend == "simd"
    positions, velocities = map(np.array, zip(*link.measured, strict=True))
    np.testing.assert_array_equal(positions, record["measured_position"].values[:-1])
    np.testing.assert_array_equal(velocities, record["measured_velocity"].values[:-1])
    np.testing.assert_array_equal(link.sent[:-1], record["commanded_input"].values[:-1])
    assert not link.sent[-1].any()


class BiasAndLoss(AbstractFaults):
    """From 0.2 s on north is 1 m off and random by centimetres, and thruster 3 gives half and announces it."""

    def realize(self, key):
        return key

    def init(self, realization, y, u):
        return jnp.zeros((), dtype=int)

    def measurement(self, realization, state, t, y):
        off = jnp.where(t < 0.2, 0.0, 1.0 + 0.01 * jax.random.normal(numbered(realization, state), dtype=t.dtype))
        wrong = with_outputs(y, y.position.at[0].add(off), y.velocity)
        return wrong._replace(health=jnp.ones(8).at[2].set(jnp.where(t < 0.2, 1.0, 0.0))), state + 1

    def input(self, realization, state, t, u, limits):
        return jnp.where(t < 0.2, u, u.at[2].multiply(0.5)), state

    def load(self, realization, t, pose, load):
        return load

    def active(self, realization, t):
        return jnp.where(t < 0.2, 0, 2)

    def jumps(self, duration):
        return (0.2,)


def test_faults_are_those_of_a_simulation(heavy):
    faulty = heavy._replace(closed_loop=dataclasses.replace(heavy.closed_loop, faults=BiasAndLoss()))
    link, record = run_of(faulty), run_scenario(faulty).dataset
    positions, _ = map(np.array, zip(*link.measured, strict=True))
    np.testing.assert_array_equal(positions, record["measured_position"].values[:-1])
    np.testing.assert_array_equal(link.sent[:-1], record["commanded_input"].values[:-1])
    assert positions[19, 0] < 0.1 and positions[21, 0] > 0.9
    healthy = np.array(link.announced)
    np.testing.assert_array_equal(healthy[:, 2], np.arange(100) < 20)
    assert healthy[:, [0, 1, 3, 4, 5, 6, 7]].all()


@pytest.fixture(scope="module")
def pendulum():
    return build(from_data(PENDULUM))


def test_a_longer_time_is_divided_into_sampling_times_and_a_rest(pendulum):
    one, other = VehicleLink(pendulum), VehicleLink(pendulum)
    for link in (one, other):
        link.receive(0.0)
        link.send(np.array([1.5]))
    found = one.receive(0.0054)
    for elapsed in (0.001,) * 5 + (0.0004,):
        expected = other.receive(elapsed)
    np.testing.assert_allclose(found.position, expected.position, rtol=0, atol=1e-15)
    np.testing.assert_allclose(found.velocity, expected.velocity, rtol=0, atol=1e-15)
    assert one.time == pytest.approx(0.0054, abs=1e-15)
    one.receive(0.0006)
    assert one.time == pytest.approx(0.006, abs=1e-15)


def test_a_vehicle_that_fails_ends_the_run(pendulum):
    link = VehicleLink(pendulum)
    link.receive(0.0)
    link.send(np.array([1e200]))
    link.receive(1.0)
    assert link.failed and "the vehicle failed at" in link.ended
