"""Motions of MuJoCo's body in water: closed forms, and undertow's own motion, approached at fourth order."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from mujoco_states import undertow_motion

from undertow.core.status import Status
from undertow.outside.mujoco_engine import Submerged
from undertow.physics.vehicles import bluerov2_heavy, odin, rexrov

pytestmark = pytest.mark.full


def nothing(body):
    return lambda t: np.zeros(body.model.nu)


def test_tumbling_top():
    """Without water and weight: r_b = r_g, W = B. Two equal inertias: (q, r) turns at (I - I_1) / I p, for ever."""
    zero, inertia = jnp.zeros((6, 6)), jnp.diag(jnp.array([2.0, 5.0, 5.0]))
    free = eqx.tree_at(
        lambda v: (v.r_g, v.inertia, v.buoyancy, v.added_mass, v.linear_damping, v.quadratic_damping),
        odin(),
        (jnp.zeros(3), inertia, odin().weight, zero, zero, zero),
    )
    body = Submerged(free)
    p, q, duration = 3.0, 0.5, 2.0
    body.place(np.zeros(6), [0, 0, 0, p, q, 0])
    body.advance(nothing(body), 1000)
    turned = (5 - 2) / 5 * p * duration
    np.testing.assert_allclose(body.nu()[3:], [p, q * np.cos(turned), -q * np.sin(turned)], atol=1e-10)
    momentum = body.rotation() @ np.diag([2, 5, 5]) @ body.nu()[3:]
    np.testing.assert_allclose(momentum, [2 * p, 5 * q, 0], atol=1e-10)
    np.testing.assert_allclose(body.position()[:3], 0, atol=1e-12)


def test_thrown_body_turns_about_its_centre_of_gravity():
    """In vacuum the centre of gravity, not the origin, moves in a straight line."""
    zero = jnp.zeros((6, 6))
    vehicle = rexrov()
    free = eqx.tree_at(
        lambda v: (v.r_g, v.r_b, v.inertia, v.buoyancy, v.added_mass, v.linear_damping, v.quadratic_damping),
        vehicle,
        (jnp.array([0.1, -0.2, 0.3]), jnp.array([0.1, -0.2, 0.3]), 2 * vehicle.inertia + 200 * jnp.eye(3))
        + (vehicle.weight, zero, zero, zero),
    )
    body, r_g = Submerged(free), np.array([0.1, -0.2, 0.3])
    body.place(np.zeros(6), [1, 0.5, -0.2, 0.8, -0.6, 0.4])
    velocity = body.nu()[:3] + np.cross(body.nu()[3:], r_g)
    body.advance(nothing(body), 500)
    centre = body.position()[:3] + body.rotation() @ r_g
    np.testing.assert_allclose(centre, r_g + 1 * velocity, atol=1e-10)


def test_heel():
    """Weightless in water, a small heel swings at sqrt(B z / (I + A)); I is the engine's, A is applied."""
    vehicle, zero, heel = bluerov2_heavy(), jnp.zeros((6, 6)), 1e-4
    changed = vehicle.weight, zero, zero
    calm = eqx.tree_at(lambda v: (v.buoyancy, v.linear_damping, v.quadratic_damping), vehicle, changed)
    rate = np.sqrt(132.57 * 0.01 / (0.26 + 0.189))
    body = Submerged(calm, timestep=0.01)
    body.place([0, 0, 0, heel, 0, 0], np.zeros(6))
    for _ in range(10):
        body.advance(nothing(body), 40)
        assert body.position()[3] == pytest.approx(heel * np.cos(rate * body.data.time), abs=1e-6 * heel)


def test_terminal_velocity():
    """Sinking: 33 w + 190 w^2 = W - B."""
    body = Submerged(bluerov2_heavy(), timestep=0.05)
    body.place(np.zeros(6), np.zeros(6))
    body.advance(nothing(body), 800)
    surplus = 132.57 - 131.588
    expected = (np.sqrt(33**2 + 4 * 190 * surplus) - 33) / (2 * 190)
    np.testing.assert_allclose(body.nu(), [0, 0, expected, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    "make", [odin, *(pytest.param(make, marks=pytest.mark.slow) for make in (bluerov2_heavy, rexrov))]
)
def test_motions_converge_at_fourth_order(make):
    """Two seconds of tumbling in water. Undertow's own error at 0.5 ms is below 1e-12."""
    eta, nu = np.array([0, 0, 0, 0.3, -0.2, 0.5]), np.array([1, 0.3, -0.2, 0.8, 0.5, -0.6])
    there = np.concatenate(undertow_motion(make(), eta, nu, 2.0, 5e-4))
    errors = []
    for timestep in (0.01, 0.005):
        body = Submerged(make(), timestep)
        body.place(eta, nu)
        body.advance(nothing(body), round(2 / timestep))
        errors.append(np.abs(np.concatenate([body.position()[:3], body.nu()]) - there).max())
    assert 3.5 < np.log2(errors[0] / errors[1]) < 4.5
    assert errors[1] < 1e-8


def test_warnings_are_failures_and_nothing_starts_anew(tmp_path, monkeypatch):
    """By itself MuJoCo would count a warning and go back to where the model begins."""
    monkeypatch.chdir(tmp_path)  # where it writes its log
    body = Submerged(odin())
    body.place([1, 2, 3, 0, 0, 0], np.zeros(6))
    body.advance(lambda t: np.full(8, np.nan), 10)
    assert body.status() == Status.NOT_FINITE
    assert body.data.time == body.model.opt.timestep  # it went no further
    assert not np.isfinite(body.nu()).all()
    body.place([1, 2, 3, 0, 0, 0], np.zeros(6))
    assert body.status() == Status.OK
    body.advance(lambda t: np.full(8, 1e9), 10)
    assert body.status() == Status.DIVERGED
