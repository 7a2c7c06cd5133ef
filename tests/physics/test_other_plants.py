"""The pendulum, the levitation, the arm and the linear plant: published numbers, conserved quantities, lost directions."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import energy_of_arm

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import Load, Measurement
from undertow.core.numerics.integrators import rk4
from undertow.core.status import Status
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants import inverted_pendulum, linear_plant, magnetic_levitation, two_link_arm
from undertow.physics.plants.magnetic_levitation import RIGS
from undertow.physics.plants.reachability import lost_directions, open_loop_advice
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

UNDER = ((1.0, 0.0), (1.0, 0.0), (0.0, 1.0))  # pushes x1 and x2 alike
PLANTS = {
    "pendulum": inverted_pendulum(),
    "levitation": magnetic_levitation(fidelity="ideal"),
    "arm": two_link_arm(),
    "redundant": linear_plant(position_term=-np.eye(2), velocity_term=-0.3 * np.ones((2, 2))),
    "under-actuated": linear_plant(UNDER, -4 * np.eye(3)),
}


def start(plant, seed=0, scale=0.5):
    """Random outputs and rates; the ball between its magnets."""
    rng, n = np.random.default_rng(seed), len(plant.outputs)
    position, velocity = scale * rng.normal(size=n), rng.normal(size=n)
    if plant.outputs == ("z",):
        position, velocity = np.array([0.012]), np.array([0.02])
    return plant.initial_state(jnp.asarray(position), jnp.asarray(velocity))


def integrate(plant, x, u, duration, dt):
    """State after a time under a constant input, by RK4."""

    @eqx.filter_jit
    def run(plant, x, dt, steps):
        field = lambda t, x: plant.dynamics(t, x, jnp.asarray(u), plant.no_load())
        return jax.lax.fori_loop(0, steps, lambda k, x: rk4(field, jnp.zeros(()), x, dt), x)

    return run(plant, x, np.asarray(dt), np.asarray(round(duration / dt)))


# ------------------------------------------------------------------------------------------------- every plant


@pytest.mark.parametrize("name", PLANTS)
def test_a_model_told_the_truth_gives_the_acceleration(name):
    """x_ddot = F + G u + d, with d the load, at random states; and G G# a = a as far as the range of G goes."""
    plant = PLANTS[name]
    dynamics, rng = plant.model().dynamics, np.random.default_rng(1)

    @jax.jit
    @jax.vmap
    def evaluate(x, u, acceleration):
        y, load = plant.output(0.0, x), plant.no_load()._replace(acceleration=acceleration)
        rates = plant.dynamics(0.0, x, u, load)
        _, second = jax.jvp(lambda x: plant.output(0.0, x).velocity, (x,), (rates,))
        push = dynamics.gain(y) @ u
        reached = dynamics.gain(y) @ dynamics.invert(y, push)
        return plant.acceleration(0.0, x, u, load), second, dynamics.drift(y), push, reached

    states = jax.tree.map(lambda *each: np.stack(each), *(start(plant, seed) for seed in range(20)))
    u, loads = rng.uniform(0.1, 2.0, (20, plant.inputs())), rng.normal(size=(20, len(plant.outputs)))
    found, second, drift, push, reached = map(np.asarray, evaluate(states, u, loads))
    np.testing.assert_allclose(found, drift + push + loads, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(second, found, rtol=1e-14, err_msg="the state moves as `acceleration` says")
    np.testing.assert_allclose(reached, push, rtol=1e-12, atol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("name", PLANTS)
def test_every_plant_converges_at_fourth_order(name):
    plant = PLANTS[name]
    x, u = start(plant, 3), 0.3 * np.ones(plant.inputs())
    dt = 4e-3 if name == "levitation" else 0.05
    ends = [np.concatenate([np.ravel(leaf) for leaf in integrate(plant, x, u, 8 * dt, dt / 2**k)]) for k in range(3)]
    coarse, fine = np.abs(ends[0] - ends[1]).max(), np.abs(ends[1] - ends[2]).max()
    assert fine > 1e-13, "above rounding"
    assert 3.7 <= np.log2(coarse / fine) <= 4.4, (coarse, fine)


# ---------------------------------------------------------------------------------------------------- pendulum


def test_pendulum_published_values():
    """Wang's constants: b(0) = 1.46341 1/(kg m), slope 15.7756 1/s^2, so an unstable pole at 3.972 1/s."""
    cart_pole = inverted_pendulum().cart_pole
    drift = lambda angle, rate: cart_pole.drift(Measurement(angle, rate))
    evaluate = jax.jit(lambda angle, rate: (cart_pole.lever(angle), drift(angle, rate), jax.grad(drift)(angle, rate)))
    lever, _, slope = evaluate(0.0, 0.0)
    np.testing.assert_allclose(lever, 1.4634146, rtol=1e-7)
    np.testing.assert_allclose(slope, 15.7756, rtol=2e-6)
    np.testing.assert_allclose(np.sqrt(slope), 3.972, atol=5e-4)
    np.testing.assert_allclose(evaluate(0.3, 1.2)[1], _textbook_drift(0.3, 1.2), rtol=1e-13)


def _textbook_drift(x1, x2, m_c=1.0, m=0.1, half=0.5, g=9.8):
    """f of the codes that go with Liu's textbooks."""
    fall = g * np.sin(x1) - m * half * x2**2 * np.cos(x1) * np.sin(x1) / (m_c + m)
    return fall / (half * (4 / 3 - m * np.cos(x1) ** 2 / (m_c + m)))


def pendulum_energy(plant, x):
    """Kinetic energy of cart and uniform pole, and height, J: nothing of the equations of motion is used."""
    c = plant.cart_pole
    sideways = x.cart_speed - c.half_length * x.rate * jnp.cos(x.angle)  # a positive angle leans away from the force
    upward = -c.half_length * x.rate * jnp.sin(x.angle)
    turning = c.pole_mass * c.half_length**2 / 3 * x.rate**2 / 2
    moving = (c.cart_mass * x.cart_speed**2 + c.pole_mass * (sideways**2 + upward**2)) / 2
    return (moving + turning + c.pole_mass * c.gravity * c.half_length * jnp.cos(x.angle))[0]


def test_pendulum_and_cart_keep_their_energy_and_momentum():
    """No friction, no force: both stay while the pole falls through the horizontal and back."""
    plant = inverted_pendulum(cart_mass=0.3)
    x = plant.initial_state(jnp.array([0.4]), jnp.array([0.5]))._replace(cart_speed=jnp.array([0.2]))
    end = integrate(plant, x, [0.0], 3.0, 1e-3)
    assert abs(end.rate[0] - x.rate[0]) > 0.1
    energy = jax.jit(lambda x: pendulum_energy(plant, x))
    np.testing.assert_allclose(energy(end), energy(x), rtol=1e-9)


@pytest.mark.full
def test_work_of_the_force_is_the_gain_of_energy():
    plant = inverted_pendulum()

    @jax.jit
    def evaluate(x, u):
        rates = plant.dynamics(0.0, x, u, plant.no_load())
        return jax.jvp(lambda x: pendulum_energy(plant, x), (x,), (rates,))[1], plant.effort(x, u).power[0]

    for seed in range(20):
        x = start(plant, seed, scale=1.0)._replace(cart_speed=np.array([0.7]))
        rate, power = evaluate(x, np.array([3.0]))
        np.testing.assert_allclose(rate, power, rtol=1e-12, atol=1e-12)


def test_pendulum_ends_where_its_pole_lies_flat():
    plant = inverted_pendulum()
    status = jax.jit(lambda position: plant.status(plant.initial_state(position)))
    assert status(np.array([1.5])) == int(Status.OK)
    assert status(np.array([1.57])) == int(Status.OUT_OF_RANGE)


# -------------------------------------------------------------------------------------------------- levitation

# Balko and Rosinova 2017, Table I, ball of 39 g: z (mm), I (A), U, -dL/dz (H/m).
MEASURED = np.array(
    [
        [8.5, 1.025, 0.315, 0.7096],
        [9.0, 1.078, 0.328, 0.6416],
        [9.5, 1.126, 0.344, 0.588],
        [10.0, 1.189, 0.352, 0.5274],
        [10.5, 1.237, 0.362, 0.4872],
        [11.0, 1.285, 0.378, 0.4515],
        [11.5, 1.35, 0.392, 0.4091],
        [12.0, 1.408, 0.413, 0.3761],
        [12.5, 1.475, 0.423, 0.3427],
        [13.0, 1.543, 0.432, 0.3131],
        [13.5, 1.617, 0.446, 0.2851],
        [14.0, 1.679, 0.462, 0.2645],
    ]
)  # fmt: skip
BALLS = {
    "balko_rosinova": (1.19, 0.363, -16.5),
    "balko_rosinova_23g": (0.914, 0.300, -21.5),
    "balko_rosinova_16g": (0.762, 0.265, -25.7),
}


def test_levitation_meets_the_twelve_measured_points():
    """The current that holds the ball within 2.1 %, half of them within 0.5 %; the duty cycle within 0.0125.

    The printed slopes are no measurement of their own: they are 2 m g / I^2 to their last digit, with a ball of 38 g.
    """
    rig = RIGS["balko_rosinova"]()
    millimetres, current, duty, slope = MEASURED.T
    evaluate = jax.jit(lambda z, squared: (jax.vmap(rig.pull)(z), jax.vmap(rig.duty)(squared)))
    pull, found = evaluate(1e-3 * millimetres[:, None], np.stack([current, current], 1) ** 2)
    pull = -np.asarray(pull)[:, 0]
    held = np.sqrt(rig.gravity / pull)
    off = np.abs(held / current - 1)
    assert off.max() < 0.021 and np.median(off) < 0.005, off
    np.testing.assert_allclose(found[:, 0], duty, atol=0.0125)
    np.testing.assert_allclose(2 * rig.mass * pull, slope, rtol=0.039)
    np.testing.assert_allclose(2 * 0.038 * 9.81 / current**2, slope, rtol=3e-4)
    without_half = np.sqrt(rig.gravity / (2 * pull))
    assert np.abs(without_half / current - 1).min() > 0.27, "negative control: the force of the manual"


@eqx.filter_jit
def linearised(rig):
    """I0, U0, and the rates and both Jacobians there."""

    def field(state, duty):
        """The printed equations with the upper coil only; pull and lag are those of the rig."""
        z, v, i = state
        ball = rig.gravity + rig.pull(z[None])[0] * i**2
        return jnp.stack([v, ball, (rig.current_gain * duty + rig.current_offset - i) / rig.lag(z[None])[0]])

    z = jnp.array([0.010])
    i0 = jnp.sqrt(rig.gravity / -rig.pull(z)[0])
    u0 = (i0 - rig.current_offset) / rig.current_gain
    state = jnp.stack([z[0], jnp.zeros(()), i0])
    return i0, u0, field(state, u0), jax.jacfwd(field)(state, u0), jax.jacfwd(field, argnums=1)(state, u0)


@pytest.mark.parametrize("name", BALLS)
def test_levitation_linearised_at_10_mm_as_published(name):
    """d(z, v, I1)/dt: 1685, a23, -288.8 and 1271; I0 and U0; poles +-41.04 and -288.8 1/s."""
    (current, duty, by_current), (i0, u0, rates, a, b) = BALLS[name], map(np.asarray, linearised(RIGS[name]()))
    np.testing.assert_allclose(rates, 0.0, atol=1e-12)
    digits = np.array([a[1, 0], a[1, 2], a[2, 2], b[2]]) - [1685.0, by_current, -288.8, 1271.0]
    assert (np.abs(digits) <= [0.5, 0.05, 0.05, 0.5]).all(), "half of the last printed digit"
    np.testing.assert_allclose([i0, u0], [current, duty], atol=2.1e-3)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(a).real), [-288.8, -41.04, 41.04], rtol=3e-4)


def test_levitation_plant_moves_by_the_same_equations():
    """Its input is the squared current that is asked for; the duty cycle that gives it stays within [0, 1]."""
    plant = magnetic_levitation()
    rig = plant.rig

    @jax.jit
    def evaluate(x, asked):
        given = plant.admissible(x, asked)
        duty = rig.duty(given)
        rates = plant.dynamics(0.0, x, given, plant.no_load())
        return given, rates, duty, rig.demand(duty), plant.effort(x, given).saturated

    x = start(plant)._replace(current=np.array([1.1, 0.3]))
    demand, rates, duty, _, saturated = evaluate(x, np.array([1.5**2, -4.0]))
    np.testing.assert_allclose(demand, [2.25, 0.03884**2], rtol=1e-12)
    gap = 0.1 - 0.054 - 0.012
    upper, lower = (1.7521e-2 / 5.8231e-3 * np.exp(-s / 5.8231e-3) * i**2 / 2 for s, i in ((0.012, 1.1), (gap, 0.3)))
    np.testing.assert_allclose(rates.speed, 9.81 + (lower - upper) / 0.039, rtol=1e-12)
    lag = 1.4142e-4 / 4.5626e-3 * np.exp(-0.012 / 4.5626e-3)
    np.testing.assert_allclose(rates.current[0], (1.5 - 1.1) / lag, rtol=1e-12)
    assert (np.asarray(duty) >= 0).all()
    np.testing.assert_array_equal(saturated, 0.0)
    most, _, duty, back, saturated = evaluate(x, np.array([99.0, 99.0]))
    np.testing.assert_allclose(back, most, rtol=1e-12)
    assert (np.asarray(duty) <= 1).all()
    np.testing.assert_array_equal(saturated, 1.0)


@pytest.mark.parametrize(("height", "status"), [(-1e-6, "OUT_OF_RANGE"), (0.0459, "OK"), (0.0461, "OUT_OF_RANGE")])
def test_levitation_ends_at_either_coil(height, status):
    plant = magnetic_levitation()
    assert float(plant.rig.travel) == pytest.approx(0.1 - 0.054)
    x = start(plant)._replace(z=np.array([height]))
    assert int(plant.status(x)) == int(Status[status])


def test_levitation_allocates_to_the_coil_that_pulls_the_wanted_way():
    plant = magnetic_levitation(fidelity="ideal")
    dynamics = plant.model().dynamics
    both = jax.jit(lambda y, wanted: (dynamics.invert(y, wanted), dynamics.gain(y)))
    for wanted in (-3.0, 5.0):
        u, gain = map(np.asarray, both(Measurement(np.array([0.012]), np.zeros(1)), np.array([wanted])))
        assert (u >= 0).all() and (u > 0).sum() == 1
        np.testing.assert_allclose(gain @ u, wanted, rtol=1e-13)


# --------------------------------------------------------------------------------------------------------- arm


def test_arm_mass_and_coriolis_matrices():
    """M symmetric positive definite, inverse right, M_dot - 2 C skew, along the motion."""
    links, rng = two_link_arm().links, np.random.default_rng(2)

    @jax.jit
    def evaluate(q, rate):
        mass, change = jax.jvp(links.mass_matrix, (q,), (rate,))
        return mass, change, links.inverse_mass_matrix(q), links.coriolis_matrix(q, rate)

    for _ in range(30):
        mass, change, inverse, coriolis = map(np.asarray, evaluate(rng.uniform(-3, 3, 2), rng.normal(size=2)))
        np.testing.assert_array_equal(mass, mass.T)
        assert np.linalg.eigvalsh(mass).min() > 0
        np.testing.assert_allclose(mass @ inverse, np.eye(2), atol=1e-13)
        skew = change - 2 * coriolis
        np.testing.assert_allclose(skew, -skew.T, atol=1e-14)


def test_arm_moves_by_lagrange():
    """M q_ddot from the energy alone: d/dt dL/dq_dot = dL/dq, with L = T - U by automatic differentiation."""
    plant, rng = two_link_arm(), np.random.default_rng(4)
    links = plant.links
    still = jnp.zeros(2)
    lagrangian = lambda q, rate: energy_of_arm(links, q, rate) - 2 * energy_of_arm(links, q, still)
    slopes = lambda q, rate: jax.grad(lagrangian, (1, 0))(q, rate)

    @jax.jit
    def both(q, rate):
        (by_place, mass), slope = jax.jacfwd(slopes, (0, 1), has_aux=True)(q, rate)
        forces = slope - by_place @ rate
        weights = jax.grad(energy_of_arm, argnums=1)(links, q, still), links.weight(q)
        return forces, mass, links.drift(Measurement(q, rate)), weights

    for _ in range(20):
        forces, mass, drift, weights = both(rng.uniform(-3, 3, 2), rng.normal(size=2))
        np.testing.assert_allclose(drift, np.linalg.solve(mass, forces), rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(*weights, rtol=1e-12, atol=1e-13)


@pytest.mark.full
def test_arm_keeps_its_energy_and_gains_the_work_of_its_torques():
    plant = two_link_arm()
    x = start(plant, 5, scale=1.0)

    @jax.jit
    def evaluate(x, u):
        rates = plant.dynamics(0.0, x, u, plant.no_load())
        energy = jax.jvp(lambda x: energy_of_arm(plant.links, x.position, x.velocity), (x,), (rates,))
        return *energy, plant.effort(x, u).power.sum()

    end = integrate(plant, x, [0.0, 0.0], 5.0, 5e-4)
    u = np.array([3.0, -1.0])
    energy, rate, power = map(float, evaluate(x, u))
    np.testing.assert_allclose(evaluate(end, u)[0], energy, atol=1e-8 * abs(energy) + 1e-8)
    np.testing.assert_allclose(rate, power, rtol=1e-12)


# ------------------------------------------------------------------------------------------------ lost directions


@pytest.mark.parametrize(
    ("gain", "lost"),
    [
        (np.eye(3), np.zeros((0, 3))),
        (UNDER, [[np.sqrt(0.5), -np.sqrt(0.5), 0.0]]),
        (((1.0, 0.0), (0.0, 0.0), (0.0, 1.0)), [[0.0, 1.0, 0.0]]),
        (((1.0, 1.0), (1.0, 1.0), (2.0, 2.0)), None),
        (((1.0,), (2.0,), (2.0,)), None),
    ],
)
def test_lost_directions_span_the_left_null_space(gain, lost):
    found, gain = lost_directions(np.asarray(gain)), np.asarray(gain)
    assert len(found) == len(gain) - np.linalg.matrix_rank(gain)
    np.testing.assert_allclose(found @ gain, 0.0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    assert np.linalg.matrix_rank(found) == len(found) if len(found) else True
    if lost is not None:
        np.testing.assert_allclose(found, lost, atol=1e-14)


def test_lost_directions_are_announced_and_none_where_there_are_none():
    advice = open_loop_advice("the gain matrix", np.asarray(UNDER), ("x1", "x2", "x3"))
    assert advice == linear_plant(UNDER).advice()
    assert "rank 2 of 3" in advice[0] and "direction 0.71 x1 - 0.71 x2 cannot be controlled" in advice[0]
    assert linear_plant().advice() == ()


@pytest.mark.full
def test_under_actuated_controlled_rows_follow_and_the_rest_is_the_open_loop():
    """I29: (x1 + x2, x3) obey the error equation to 1e-9; x1 - x2 is the uncontrolled plant to 1e-9."""
    springs, brakes = -np.eye(3), -0.5 * np.eye(3)
    plant = linear_plant(UNDER, springs, brakes)
    load = sinusoid(1.0, jnp.array([1.0, 2.0, 3.0]))
    loop = ClosedLoop(plant, rcaf(plant.model(), preset="paper"), setpoint([1.0, 0.0, 1.0]), load, perfect())
    outcome = sampled.simulate(loop, duration=12.0, dt=1e-3, record_every=10)
    samples = outcome.signals
    error, apart = np.asarray(samples["error"]), np.array([1.0, -1.0, 0.0])
    late = np.asarray(outcome.time) > 8
    together = (error[:, 0] + error[:, 1])[late]
    assert np.abs(together).max() < 0.02 and np.abs(error[late, 2]).max() < 0.02

    idle = ClosedLoop(linear_plant(UNDER, springs, brakes, limit=0.0), loop.controller, loop.reference, load, perfect())
    free = np.asarray(sampled.simulate(idle, duration=12.0, dt=1e-3, record_every=10).signals["position"])
    np.testing.assert_allclose(np.asarray(samples["position"]) @ apart, free @ apart, atol=1e-9)
    assert np.abs((np.asarray(samples["position"]) - free) @ np.array([1.0, 1.0, 0.0])).max() > 0.1, "negative control"


@pytest.mark.full
def test_under_actuated_error_equation_holds_along_the_controlled_rows():
    """Q^T (e_ddot + K^T E - d_hat + d + u_r) = 0 to 1e-9, with Q an orthonormal basis of the range of G."""
    plant = linear_plant(UNDER, -np.eye(3), -0.5 * np.eye(3))
    loop = ClosedLoop(
        plant, rcaf(plant.model(), preset="paper"), setpoint([1.0, 0.0, 1.0]), sinusoid(1.0, 2.0), perfect()
    )
    drawn, rng = loop.realize(jax.random.PRNGKey(0)), np.random.default_rng(6)
    basis = np.linalg.svd(np.asarray(UNDER))[0][:, :2]

    @jax.jit
    def residual_at(t, x, z):
        seen, load = drawn.decide(t, x, z), drawn.load(t, x)
        sample = drawn.signals(t, x, z, seen)
        acceleration = plant.acceleration(t, x, seen.applied, load)
        k1, k2 = loop.controller.feedback
        left = seen.r.acceleration - acceleration + k1 * sample["error"] + k2 * (seen.r.velocity - sample["velocity"])
        return left - sample["estimate"] + load.acceleration + sample["robust_term"]

    for t in rng.uniform(0, 5, 10):
        x, z = drawn.start(jnp.asarray(rng.normal(size=3)), jnp.asarray(rng.normal(size=3)))
        z = z._replace(weights=jnp.asarray(rng.normal(size=z.weights.shape)))
        residual = np.asarray(residual_at(t, x, z))
        np.testing.assert_allclose(basis.T @ residual, 0.0, atol=1e-9)
        assert np.abs(residual).max() > 1e-3, "negative control: not so across them"


def test_loads_act_as_they_say():
    """A wrench opposes: through the mass for the ball, through M^-1 for the arm."""
    ball, arm = magnetic_levitation(fidelity="ideal"), two_link_arm()
    for plant, mobility in ((ball, np.eye(1) / 0.039), (arm, None)):
        x = start(plant)
        n = len(plant.outputs)
        push, u = np.arange(1.0, n + 1), np.zeros(plant.inputs())
        under = jax.jit(lambda x, u, wrench, plant=plant: plant.acceleration(0.0, x, u, Load(0 * wrench, wrench)))
        change = np.asarray(under(x, u, push)) - under(x, u, 0 * push)
        mobility = plant.links.inverse_mass_matrix(x.position) if mobility is None else mobility
        np.testing.assert_allclose(change, -mobility @ push, rtol=1e-10, atol=1e-12)


def test_power_of_the_arm_is_torque_times_rate():
    plant = two_link_arm()
    x = plant.initial_state(jnp.array([0.3, -0.4]), jnp.array([0.7, -1.1]))
    np.testing.assert_allclose(plant.power(x, jnp.array([2.0, 3.0])), [1.4, -3.3])
