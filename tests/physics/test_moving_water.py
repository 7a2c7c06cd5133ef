"""Currents and waves: Galileo's and Einstein's principles, the sea's statistics, orbital decay."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import rotation_from_euler

from undertow.core.contracts import Pose, Water
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import rk4
from undertow.physics.disturbances.current import current
from undertow.physics.disturbances.gauss_markov_current import gauss_markov_current
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.disturbances.sheared_current import sheared_current
from undertow.physics.disturbances.waves import spectrum, waves
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin

PLANT = hybrid_vehicle(odin(), paper_table3("shaft"))
CALM = PLANT.no_load()
POSE = jnp.array([1.0, -2.0, 3.0, 0.3, -0.5, 2.0])
RATES = jnp.array([0.4, -0.2, 0.1, 0.05, 0.1, -0.2])
VOLTS = jnp.linspace(-6.0, 8.0, 8)
STEP, TICKS = 2e-3, 2500
ONE = jnp.ones(())


def at(position):
    return Pose(jnp.asarray(position), rotation_from_euler(POSE[3:]), jnp.zeros(3))


@eqx.filter_jit
def fly(disturbance, velocity):
    """Outputs after five seconds."""
    path = disturbance.realize(jax.random.PRNGKey(0))

    def rate(t, x):
        return PLANT.dynamics(t, x, VOLTS, disturbance.at(path, t, PLANT.pose(x), CALM))

    def step(k, x):
        return rk4(rate, k.astype(float) * STEP, x, jnp.asarray(STEP))

    y = PLANT.output(0.0, jax.lax.fori_loop(0, TICKS, step, PLANT.initial_state(POSE, velocity)))
    return jnp.concatenate([y.position, y.velocity])


@pytest.mark.full
def test_galileo():
    """In a constant current everything happens as in still water, carried along."""
    flow = np.array([0.7, -0.4, 0.2])
    still = fly(current(np.zeros(3)), RATES)
    carried = fly(current(flow), RATES.at[:3].add(flow))
    shift = np.concatenate([flow * STEP * TICKS, np.zeros(3), flow, np.zeros(3)])
    np.testing.assert_allclose(carried - shift, still, rtol=0, atol=1e-10)


@pytest.mark.full
def test_still_water_is_no_water():
    np.testing.assert_allclose(fly(current(np.zeros(3)), RATES), fly(SumOfDisturbances(()), RATES), rtol=0, atol=1e-12)


def accelerating(acceleration):
    return CALM._replace(water=Water(jnp.zeros(3), jnp.asarray(acceleration)))


def test_einstein():
    """A neutral body with CB on CG, at rest in the water, goes where accelerating water takes it."""
    neutral = eqx.tree_at(lambda p: (p.body.buoyancy, p.body.r_b), PLANT, (PLANT.body.weight, PLANT.body.r_g))
    push = [0.3, -0.2, 0.1]
    rate = jax.jit(lambda plant, x, load: plant.acceleration(0.0, x, jnp.zeros(8), load))(
        neutral, neutral.initial_state(POSE, jnp.zeros(6)), accelerating(push)
    )
    np.testing.assert_allclose(rate, [*push, 0, 0, 0], rtol=0, atol=1e-12)


def test_morison():
    """Held at rest in accelerating water: the displaced water's inertia at CB and the added mass, as a wrench."""
    body, push = odin(), np.array([0.5, -0.3, 0.2])
    x = PLANT.initial_state(jnp.zeros(6), jnp.zeros(6))
    under = lambda load: PLANT.dynamics(jnp.zeros(()), x, jnp.zeros(8), load).nu
    rate, still = map(np.asarray, jax.jit(lambda load: (under(load), under(CALM)))(accelerating(push)))
    displaced = float(body.buoyancy / (body.weight / body.mass)) * push
    expected = np.concatenate([displaced, np.cross(body.r_b, displaced)])
    expected += np.asarray(body.added_mass) @ np.concatenate([push, np.zeros(3)])
    np.testing.assert_allclose(np.asarray(body.mass_matrix()) @ (rate - still), expected, rtol=0, atol=1e-10)


def water_of(disturbance, key, t, position):
    return disturbance.at(disturbance.realize(key), t, at(position), CALM).water


@eqx.filter_jit
def flow_of(sea, key, t):
    """Acceleration of the water, and derivatives of its velocity by time and by place."""
    path = sea.realize(key)

    def velocity(t, position):
        water = sea.at(path, t, at(position), CALM).water
        return water.velocity, water.acceleration

    slopes, acceleration = jax.jacfwd(velocity, (0, 1), has_aux=True)(t, jnp.array([3.0, -2.0, 1.0]))
    return acceleration, *slopes


def test_peak_of_the_spectrum():
    """JONSWAP is Pierson-Moskowitz with its peak raised by gamma, narrower below (0.07) than above (0.09)."""
    ratio = jnp.array([0.7, 0.93, 1.0, 1.09, 1.4])
    frequency = ratio * 2 * np.pi / 5.0
    raised = spectrum(frequency, 5.0, 3.3) / spectrum(frequency, 5.0, 1.0)
    expected = [3.3 ** np.exp(-(0.3**2) / 2 / 0.07**2), 3.3 ** np.exp(-0.5), 3.3, 3.3 ** np.exp(-0.5)]
    np.testing.assert_allclose(raised, [*expected, 3.3 ** np.exp(-(0.4**2) / 2 / 0.09**2)], rtol=1e-12)
    np.testing.assert_allclose(spectrum(frequency, 5.0, 1.0), ratio**-5 * np.exp(-1.25 / ratio**4), rtol=1e-12)


def test_above_the_surface_the_water_moves_as_on_it():
    sea = waves(depth=2.0)

    @jax.jit
    def speeds(depths):
        path = sea.realize(jax.random.PRNGKey(0))
        flow = lambda down: sea.at(path, jnp.asarray(1.5), at(jnp.stack([ONE, ONE, down])), CALM).water.velocity
        return jax.vmap(flow)(-depths)

    surface, above, below = speeds(np.array([2.0, 2.5, 1.0]))
    np.testing.assert_array_equal(above, surface)
    assert np.linalg.norm(below) < 0.9 * np.linalg.norm(surface)


def test_wave_acceleration_is_the_rate_of_the_velocity():
    sea = waves(spreading=0.3)
    for t in (0.0, 7.3, 100.0):
        acceleration, by_time, _ = flow_of(sea, jax.random.PRNGKey(5), np.asarray(t))
        np.testing.assert_allclose(acceleration, by_time, rtol=0, atol=1e-12)


def test_waves_are_incompressible_and_free_of_rotation():
    gradient = np.asarray(flow_of(waves(spreading=0.5), jax.random.PRNGKey(1), np.asarray(4.0))[2])
    assert abs(np.trace(gradient)) < 1e-12 and np.abs(gradient).max() > 1e-3
    np.testing.assert_allclose(gradient, gradient.T, rtol=0, atol=1e-12)


@eqx.filter_jit
def velocities(sea, key, times):
    """Of 400 seas, one row for each."""

    def course(key):
        path = sea.realize(key)
        return jax.lax.map(lambda t: sea.at(path, t, at(jnp.zeros(3)), CALM).water.velocity, times)

    return jax.lax.map(course, jax.random.split(key, 400))


@pytest.mark.parametrize("depth", [3.0, pytest.param(0.0, marks=pytest.mark.full)])
def test_variance_of_orbital_velocity(depth):
    """Over 400 seas: the integral of omega^2 S(omega) e^(-2 k z), S scaled to (H_s / 4)^2; at the surface its H_s."""
    sea = waves(height=0.5, period=5.0, depth=depth)
    velocity = velocities(sea, jax.random.PRNGKey(2), np.linspace(0.0, 50.0, 20))
    omega = np.linspace(0.4, 8.0, 20_000) * 2 * np.pi / 5
    energy = np.array(jax.jit(spectrum)(omega, 5.0, 3.3))
    energy *= (0.5 / 4) ** 2 / np.trapezoid(energy, omega)
    expected = np.trapezoid(omega**2 * energy * np.exp(-2 * omega**2 / 9.81 * depth), omega)
    found = np.asarray(velocity).var(axis=(0, 1))
    np.testing.assert_allclose(found[[0, 2]], expected, rtol=0.05)
    assert float(jax.jit(type(sea).orbital_speed)(sea, np.asarray(depth))) ** 2 == pytest.approx(expected, rel=5e-3)
    assert found[1] < 1e-20  # all run north


@pytest.mark.full
def test_wandering_current_has_its_variance_and_correlation():
    process = gauss_markov_current(mean=(0.3, 0.0, 0.0), deviation=(0.1, 0.2, 0.0), correlation_time=10.0, step=0.5)
    paths = np.asarray(jax.jit(jax.vmap(process.realize))(jax.random.split(jax.random.PRNGKey(3), 500)))
    np.testing.assert_allclose(paths.std(axis=(0, 1)), [0.1, 0.2, 0.0], rtol=0.02)
    lag = 20  # 10 s
    correlation = (paths[:, :-lag, :2] * paths[:, lag:, :2]).mean(axis=(0, 1)) / paths[..., :2].var(axis=(0, 1))
    np.testing.assert_allclose(correlation, np.exp(-1), rtol=0.05)


def test_wandering_current_is_its_samples_and_linear_between():
    process = gauss_markov_current(span=10.0, step=0.5)
    drawn = np.asarray(jax.jit(lambda key: process.realize(key))(jax.random.PRNGKey(4)))
    path = drawn + [0.3, 0.0, 0.0]
    flow = jax.jit(lambda drawn, t: process.at(drawn, t, at(np.zeros(3)), CALM).water)
    for t, expected, slope in (
        (2.0, path[4], (path[5] - path[4]) / 0.5),
        (2.25, path[4:6].mean(0), (path[5] - path[4]) / 0.5),
        (99.0, path[-1], np.zeros(3)),
    ):
        water = flow(drawn, t)
        np.testing.assert_allclose(water.velocity, expected, rtol=0, atol=1e-12)
        np.testing.assert_allclose(water.acceleration, slope, rtol=0, atol=1e-12)
    assert process.jumps(1.2) == (0.5, 1.0)


@jax.jit
def sheared(position):
    return water_of(sheared_current(), jax.random.PRNGKey(0), 0.0, position)


@pytest.mark.parametrize(("down", "north"), [(-1.0, 0.8), (0.0, 0.8), (10.0, 0.45), (20.0, 0.1), (50.0, 0.1)])
def test_sheared_current(down, north):
    water = sheared(np.array([0.0, 0.0, down]))
    np.testing.assert_allclose(water.velocity, [north, 0, 0], rtol=0, atol=1e-12)


def test_currents_add_and_each_member_has_its_own_randomness():
    wandering = gauss_markov_current(span=10.0)
    two = SumOfDisturbances((wandering, wandering, current((0.0, 0.2, 0.0))))

    @jax.jit
    def draw(key):
        path = two.realize(key)
        return path, two.at(path, jnp.asarray(3.0), at(jnp.zeros(3)), CALM).water

    path, water = jax.tree.map(np.asarray, draw(jax.random.PRNGKey(0)))
    assert np.abs(path[0] - path[1]).max() > 0.01
    np.testing.assert_allclose(water.velocity, np.array([0.6, 0.2, 0.0]) + path[0][6] + path[1][6], rtol=0, atol=1e-12)


def test_water_needs_a_body():
    with pytest.raises(BadInput, match="`kind` must act on a body in water"):
        current().at((), 0.0, None, CALM)
