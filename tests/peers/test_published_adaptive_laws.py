"""slotine_li, mrac and adaptive_backstepping against the equations and examples of their books, integrated here."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from undertow.control.controllers import adaptive_backstepping, mrac, slotine_li
from undertow.control.controllers.adaptive_backstepping import steps
from undertow.control.navigation import perfect
from undertow.control.references import setpoint, sine
from undertow.core.contracts import AbstractReference, Target
from undertow.core.parametric_dynamics import AbstractParametricDynamics
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, linear_plant, two_link_arm
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop


def run(plant, law, reference, duration, dt, load=None, **start):
    loop = ClosedLoop(plant, law, reference, load or none(), perfect())
    found = sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)
    assert int(found.status) == 0
    return {name: np.asarray(value) for name, value in found.signals.items()}


# Slotine and Li (1991), Example 9.1: a_1 to a_4 of the arm; section 9.2: the adaptive law.
A1, A2, A3, A4 = 3.34, 0.97, 1.2 * np.cos(np.pi / 6), 1.2 * np.sin(np.pi / 6)
LAMBDA, K_D, GAMMA = 20.0, 100.0, np.array([0.03, 0.05, 0.1, 0.3])
SWING, TURN = np.radians([30.0, 45.0]), 2 * np.pi


def regressor(q, v, v_r, a_r):
    c, s = np.cos(q[1]), np.sin(q[1])
    mixed = v[1] * v_r[0] + v[0] * v_r[1] + v[1] * v_r[1]
    first = [a_r[0], a_r[1], (2 * a_r[0] + a_r[1]) * c - mixed * s, (2 * a_r[0] + a_r[1]) * s + mixed * c]
    second = [0.0, a_r[0] + a_r[1], a_r[0] * c + v[0] * v_r[0] * s, a_r[0] * s - v[0] * v_r[0] * c]
    return np.array([first, second])


def book(t, state):
    """Arm, tau = Y a_hat - K_D s and a_hat_dot = -Gamma Y^T s, with s = e_dot + Lambda e and e = q - q_d."""
    q, v, known = np.split(state, [2, 4])
    error = q - SWING * (1 - np.cos(TURN * t))
    rate, asked = v - SWING * TURN * np.sin(TURN * t), SWING * TURN**2 * np.cos(TURN * t)
    s, still = rate + LAMBDA * error, np.zeros(2)
    y = regressor(q, v, v - s, asked - LAMBDA * rate)
    true = np.array([A1, A2, A3, A4])
    mass = np.stack([regressor(q, still, still, unit) @ true for unit in np.eye(2)], axis=1)
    acceleration = np.linalg.solve(mass, y @ known - K_D * s - regressor(q, v, v, still) @ true)
    return np.concatenate([v, acceleration, -GAMMA * (y.T @ s)])


class Unknown(AbstractParametricDynamics):
    """Dynamics whose nominal parameters are zero: at the start the law knows nothing."""

    known: AbstractParametricDynamics

    def drift(self, y):
        return self.known.drift(y)

    def gain(self, y):
        return self.known.gain(y)

    def invert(self, y, acceleration):
        return self.known.invert(y, acceleration)

    def parametrization(self):
        structure = self.known.parametrization()
        return structure._replace(nominal=0 * structure.nominal)

    def generalized_force(self, y, parameters, velocity, acceleration):
        return self.known.generalized_force(y, parameters, velocity, acceleration)

    def accelerated_by(self, y, force):
        return self.known.accelerated_by(y, force)


@pytest.mark.full
def test_two_link_arm_of_slotine_and_li():
    """Largest errors in each of three seconds, 3.25 and 1.29 deg in the first, for parameters of zero at the start."""
    time = np.arange(3001) / 1000
    expected = solve_ivp(book, (0, 3), np.zeros(8), t_eval=time, rtol=1e-8, atol=1e-10).y[:2].T
    reference = SWING * (1 - np.cos(TURN * time))[:, None]
    plant, dt = two_link_arm(gravity=0.0), 2e-4
    law = slotine_li(
        plant.model(),
        sampling_time=dt,
        slope=LAMBDA,
        gain=K_D / plant.model().dynamics.parametrization().inertia,
        adaptation_rate=jnp.array([*GAMMA, 0.0]),
        reference_frequency=0.0,
    )
    law = eqx.tree_at(lambda law: law.regressor, law, Unknown(law.regressor))
    motion = sine(amplitude=SWING, frequency=TURN, phase=-np.pi / 2, offset=SWING)
    error = np.degrees(run(plant, law, motion, 3.0, dt)["error"][::5])
    peaks = lambda error: np.abs(error[:3000]).reshape(3, 1000, 2).max(1)
    found, theirs = peaks(error), peaks(np.degrees(reference - expected))
    np.testing.assert_allclose(theirs[0], [3.246, 1.288], atol=1e-3)
    np.testing.assert_allclose(found, theirs, rtol=0.01)


# Slotine and Li (1991), Example 8.1: an unknown mass of 2 kg.
MASS, L1, L2, FILTER, RATE = 2.0, 10.0, 25.0, 6.0, 0.5


class Analytic(AbstractReference):
    """Output of the book's reference model, x_m_ddot = -l_1 x_m_dot - l_2 x_m + l_2 r, in closed form."""

    moving: bool = eqx.field(static=True)

    def at(self, t):
        rate = jax.jvp(self._position, (t,), (jnp.ones_like(t),))[1]
        bend = jax.jvp(lambda t: jax.jvp(self._position, (t,), (jnp.ones_like(t),))[1], (t,), (jnp.ones_like(t),))[1]
        return Target(self._position(t), rate, bend)

    def _position(self, t):
        if not self.moving:  # r = 0 from 0.5 m
            return 0.5 * ((1 + 5 * t) * jnp.exp(-5 * t))[None]
        steady = L2 / (4j + 5) ** 2  # r = sin 4 t from rest
        left, kick = -steady.imag, -(4 * steady.real + 5 * steady.imag)
        wave = steady.real * jnp.sin(4 * t) + steady.imag * jnp.cos(4 * t)
        return (wave + (left + kick * t) * jnp.exp(-5 * t))[None]


def unknown_mass(reference, mass=0.0):
    """u = m_hat (x_m_ddot - 2 l e_dot - l^2 e), m_hat_dot = -gamma v (e_dot + l e) for 3 s."""

    def flow(t, state):
        x, v, mass = state
        x_m, v_m, a_m = table(t)
        e, rate = x - x_m, v - v_m
        asked = a_m - 2 * FILTER * rate - FILTER**2 * e
        return [v, mass * asked / MASS, -RATE * asked * (rate + FILTER * e)]

    grid = jnp.linspace(0, 3, 3001)
    table = CubicSpline(grid, np.concatenate(jax.jit(jax.vmap(lambda t: reference.at(t)))(grid), axis=1))
    time, start = np.linspace(0, 3, 301), table(0.0)[0]
    found = solve_ivp(flow, (0, 3), [start, 0.0, mass], t_eval=time, rtol=1e-8, atol=1e-10)
    return found.y[2], found.y[0] - table(time)[:, 0]


@pytest.mark.full
@pytest.mark.parametrize(("moving", "final"), [(False, 1.315), (True, 1.996)])
def test_unknown_mass_of_slotine_and_li(moving, final):
    """Errors vanish, and the estimate finds 2 kg only where the reference is persistent.

    The nominal mass is 0.01 kg, the book's initial estimate 0; other parameters hardly move at this scale.
    """
    reference, nominal, scale, dt = Analytic(moving), 0.01, 1e-4, 2e-4
    mass, _ = unknown_mass(reference)
    np.testing.assert_allclose(mass[-1], final, atol=1e-3)
    plant = linear_plant(gain=[[1 / MASS]])
    law = mrac(
        plant.model(gain=[[1 / nominal]]),
        sampling_time=dt,
        frequency=FILTER,
        damping=1.0,
        filter_ratio=1.0,
        adaptation=RATE * scale**2 / nominal,
        bound=10.0,
        scale=scale,
        reference_frequency=0.0,
    )
    found = run(plant, law, reference, 3.0, dt, position=[0.0 if moving else 0.5])
    demanded = found["input"] / nominal
    estimate = (found["input"] / (demanded + found["estimate"]))[::50, 0]
    like, error = unknown_mass(reference, nominal)
    np.testing.assert_allclose(estimate[10:], like[10:], rtol=0.02)
    np.testing.assert_allclose(estimate[-1], final, rtol=5e-3)
    np.testing.assert_allclose(-found["error"][::50, 0], error, atol=0.01 * np.abs(error).max())


def tuning_functions(error, rate, asked, estimate, given, c_3, gamma, lag):
    """Krstic, Kanellakopoulos and Kokotovic (1995), ch. 4, for x_1_dot = x_2, x_2_dot = x_3 + theta, c_1 = c_2 = 1.

    The third equation, lag x_3_dot = u - x_3, has no unknown; the output is regulated to zero.
    """
    x1, x2, x3 = -error, -rate, given - asked
    z1, z2 = x1, x2 + x1  # alpha_1 = -z_1
    alpha2 = -z1 - z2 - estimate - x2
    z3 = x3 - alpha2
    of_x1, of_x2, of_estimate = -2.0, -2.0, -1.0  # of alpha_2
    tau3 = z2 - of_x2 * z3
    alpha3 = -z2 - c_3 * z3 + of_x1 * x2 + of_x2 * (x3 + estimate) + of_estimate * gamma * tau3
    return given + lag * alpha3, gamma * tau3


@pytest.mark.parametrize("seed", range(4))
def test_tuning_functions_of_krstic_kanellakopoulos_and_kokotovic(seed):
    """The law is theirs for c = 1, and for any c in time and length scaled by it."""
    rng = np.random.default_rng(seed)
    error, rate, asked, load, given = rng.normal(size=5)
    c, c_3, gamma, lag = rng.uniform(0.3, 3.0, 4)
    found = steps(error, rate, asked, load, given, c, c_3, gamma, lag)
    u, learning = tuning_functions(
        error, rate / c, asked / c**2, load / c**2, given / c**2, c_3 / c, gamma / c**2, lag * c
    )
    np.testing.assert_allclose(float(found.demand), c**2 * u, rtol=1e-9)
    np.testing.assert_allclose(float(found.learning), c**3 * learning, rtol=1e-9)


@pytest.mark.full
def test_load_found_by_adaptive_backstepping():
    """Two steps, c = gamma = 1, a load of 1: e_ddot = -2 e - 2 e_dot + d_hat - d and d_hat_dot = -(e_dot + e)."""
    law = adaptive_backstepping(
        double_integrator(1).model(), sampling_time=1e-3, rate=1.0, adaptation=1.0, lag=0.0, reference_frequency=0.0
    )
    dt, load = 1e-3, sinusoid(0.0, 1.0, offset=1.0)
    found = run(double_integrator(1), law, setpoint([0.0]), 15.0, dt, load)
    matrix = np.array([[0.0, 1.0, 0.0], [-2.0, -2.0, 1.0], [-1.0, -1.0, 0.0]])  # e, e_dot, d_hat - d
    values, vectors = np.linalg.eig(matrix)
    time = dt * np.arange(15001)
    modes = vectors * np.linalg.solve(vectors, [0.0, 0.0, -1.0])
    error, _, off = (modes @ np.exp(np.outer(values, time))).real
    np.testing.assert_allclose(found["error"][:, 0], error, atol=1e-3)
    np.testing.assert_allclose(found["estimate"][:, 0], 1.0 + off, atol=1e-3)
