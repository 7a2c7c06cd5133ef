"""I1, I2: Coriolis forces do no work, in the body and in the earth frame; the printed earth-frame form does."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import coriolis_matrix, jacobian, kinetic_energy, shift_matrix

from undertow.physics.vehicles import odin

RNG = np.random.default_rng(1)
COUNT = 300
ETA = RNG.uniform(-1, 1, (COUNT, 6)) * np.array([10, 10, 10, np.pi, 1.3, np.pi])  # |pitch| < 1.3
NU = RNG.normal(size=(COUNT, 6))
FACTORS = RNG.normal(size=(COUNT, 6, 6))
MASS = FACTORS @ FACTORS.swapaxes(1, 2) + 0.5 * np.eye(6)
ODIN = np.asarray(odin().mass_matrix())


def each(function):
    return jax.jit(jax.vmap(function))


def earth_frame(mass, eta, nu):
    """Rate of M_J along the motion, J^-1 and J_dot."""

    def matrices(angles):
        inverse = jnp.linalg.inv(jacobian(angles))
        return inverse.T @ mass @ inverse, inverse, jacobian(angles)

    angle_rates = (jacobian(eta[3:]) @ nu)[3:]
    (_, inverse, _), (m_j_rate, _, j_rate) = jax.jvp(matrices, (eta[3:],), (angle_rates,))
    return m_j_rate, inverse, j_rate


@jax.jit
@jax.vmap
def skew_defects(mass, eta, nu):
    """||S + S^T|| / ||M_J_dot||, S = M_J_dot - 2 C_J, with C_J as it must be and as printed."""
    m_j_rate, inverse, j_rate = earth_frame(mass, eta, nu)
    coriolis = coriolis_matrix(mass, nu)

    def defect(inner):
        s = m_j_rate - 2 * inverse.T @ inner @ inverse
        return jnp.linalg.norm(s + s.T) / jnp.linalg.norm(m_j_rate)

    return defect(coriolis - mass @ inverse @ j_rate), defect(coriolis)


@pytest.mark.full
@pytest.mark.parametrize("mass", [MASS, np.tile(ODIN, (COUNT, 1, 1))], ids=["random", "odin"])
def test_rate_of_mass_matrix_less_twice_coriolis_is_skew_but_not_as_printed(mass):
    """Negative control: J^-T C J^-1 alone, as in the paper, leaves 2 M_J_dot."""
    correct, printed = skew_defects(mass, ETA, NU)
    assert float(correct.max()) <= 1e-10
    assert float(printed.min()) > 0.1
    np.testing.assert_allclose(printed, 2.0, rtol=1e-9)


@pytest.mark.full
def test_coriolis_forces_do_no_work():
    def work(mass, nu):
        c = coriolis_matrix(mass, nu)
        return jnp.abs(nu @ c @ nu) / (nu @ nu * jnp.linalg.norm(c, ord=2))

    assert float(each(work)(MASS, NU).max()) <= 1e-12


def test_coriolis_of_a_body_does_no_work_and_is_the_matrix_times_nu():
    body = odin().body()

    def compare(nu):
        force, matrix = body.coriolis(nu), coriolis_matrix(body.mass_matrix, nu)
        scale = jnp.linalg.norm(matrix, ord=2)
        work = jnp.abs(nu @ force) / (nu @ nu * scale)
        return work, jnp.abs(force - matrix @ nu).max() / (scale * jnp.linalg.norm(nu))

    work, difference = each(compare)(NU)
    assert float(work.max()) <= 1e-12
    assert float(difference.max()) <= 1e-14


@pytest.mark.full
def test_coriolis_matrix_is_skew():
    matrices = np.asarray(each(coriolis_matrix)(MASS, NU))
    np.testing.assert_array_equal(matrices, -matrices.swapaxes(1, 2))


@pytest.mark.full
def test_coriolis_forces_are_those_of_a_free_body():
    """Kirchhoff: with M nu_dot = -C nu, linear and angular momentum stay constant in the world."""

    def momentum_rates(mass, eta, nu):
        nu_rate = -jnp.linalg.solve(mass, coriolis_matrix(mass, nu) @ nu)
        position_rate, angle_rate = jnp.split(jacobian(eta[3:]) @ nu, 2)

        def in_world(position, angles, nu):
            rotation = jacobian(angles)[:3, :3]
            linear, angular = jnp.split(mass @ nu, 2)
            return jnp.concatenate([rotation @ linear, rotation @ angular + jnp.cross(position, rotation @ linear)])

        rates = (position_rate, angle_rate, nu_rate)
        momentum, rate = jax.jvp(in_world, (eta[:3], eta[3:], nu), rates)
        return jnp.linalg.norm(rate) / jnp.linalg.norm(momentum)

    assert float(each(momentum_rates)(MASS, ETA, NU).max()) <= 1e-11


@pytest.mark.full
def test_kinetic_energy_does_not_depend_on_the_reference_point():
    """1/2 nu . M nu seen from a point r away: H(r) nu and H^-T M H^-1."""
    body = odin().body()

    def energies(r, nu):
        h = shift_matrix(r)
        moved = jnp.linalg.inv(h).T @ body.mass_matrix @ jnp.linalg.inv(h)
        return kinetic_energy(body, nu), 0.5 * (h @ nu) @ moved @ (h @ nu)

    here, there = each(energies)(RNG.normal(size=(COUNT, 3)), NU)
    np.testing.assert_allclose(there, here, rtol=1e-12)
