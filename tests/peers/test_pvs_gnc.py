"""Rigid-body and hull functions against golden values of PythonVehicleSimulator's gnc.py (data/pvs_gnc.json)."""

import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from hull import SEAWATER, cross_flow_coefficient, cross_flow_drag, lift_and_drag
from textbook import coriolis_matrix, euler_rate_matrix, jacobian, rotation_from_euler, shift_matrix

from undertow.physics.vehicles import Body
from undertow.physics.vehicles.body import rigid_body_mass

PEER = json.loads((Path(__file__).parent / "data" / "pvs_gnc.json").read_text())
NU, R = np.array(PEER["nu"]), np.array(PEER["r"])
MASS = np.array(PEER["H_T_M_H"])


def golden(prefix):
    """The one value whose key starts with this; arguments stand in the key."""
    (key,) = (key for key in PEER if key.startswith(prefix))
    return np.array(PEER[key])


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_shift_of_the_reference_point():
    h = np.asarray(shift_matrix(R))
    close(h.T @ np.diag([30.0, 45, 50, 1, 3, 4]) @ h, MASS)


def test_shifted_point_mass_is_the_rigid_body_mass_matrix():
    """For equal masses along the axes H^T M H is M_RB about the new origin."""
    h = np.asarray(shift_matrix(R))
    moved = h.T @ np.diag([7.0, 7, 7, 0, 0, 0]) @ h
    inertia = 7 * (R @ R * np.eye(3) - np.outer(R, R))
    close(rigid_body_mass(7.0, R, inertia), moved)


def test_coriolis_matrix():
    close(coriolis_matrix(MASS, NU), golden("m2c("))


def test_coriolis_force():
    close(make_body().coriolis(NU), golden("m2c(") @ NU)


def make_body():
    return Body(
        mass_matrix=MASS,
        inverse_mass_matrix=np.linalg.inv(MASS),
        linear_damping=np.zeros((6, 6)),
        quadratic_damping=np.zeros((6, 6)),
        weight=300.0,
        buoyancy=310.0,
        r_g=[0.0, 0.0, 0.02],
        r_b=[0.01, -0.005, -0.03],
    )


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_restoring_forces(yaw):
    """roll 0.2, pitch -0.3; yaw makes no difference."""
    down = rotation_from_euler(jnp.array([0.2, -0.3, yaw]))[2]
    close(make_body().restoring(down), golden("gvect("))


def test_rotation_and_euler_rate_matrices():
    angles = jnp.array([0.1, -0.2, 0.5])
    close(rotation_from_euler(angles), golden("Rzyx("))
    close(euler_rate_matrix(angles), golden("Tzyx("))
    j = np.asarray(jacobian(angles))
    close(j[:3, :3], golden("Rzyx("))
    close(j[3:, 3:], golden("Tzyx("))
    close(j[:3, 3:], 0.0)
    close(j[3:, :3], 0.0)


@pytest.mark.full
def test_cross_flow_coefficient():
    close(cross_flow_coefficient(0.19, 0.19), golden("Hoerner("))


@pytest.mark.full
def test_cross_flow_drag():
    """PVS adds 21 rectangles of width L/20, so its hull sticks out by half a strip at bow and stern; undertow's
    trapezoidal rule has exactly L. The two half strips are added here before comparing.
    """
    length, beam, draft, strips = 1.6, 0.19, 0.19, 20
    ours = np.asarray(cross_flow_drag(length, beam, draft, NU, strips=strips))
    half_ends = np.zeros(6)
    for x in (-length / 2, length / 2):
        local = NU[1] + x * NU[5]
        per_metre = -0.5 * SEAWATER * draft * PEER["Hoerner(0.19,0.19)"] * abs(local) * local
        half_ends += per_metre * length / strips / 2 * np.array([0, 1, 0, 0, 0, x])
    assert np.abs(half_ends).max() > 0.1
    close(ours + half_ends, golden("crossFlowDrag("))


@pytest.mark.full
def test_cross_flow_drag_tends_to_its_integral():
    """Pure sway: force rho/2 draft Cd L |v| v exactly; sway with yaw: second order in the number of strips."""
    coefficient = 0.5 * SEAWATER * 0.19 * float(cross_flow_coefficient(0.19, 0.19))
    sway = cross_flow_drag(1.6, 0.19, 0.19, jnp.array([1.0, -0.3, 0, 0, 0, 0]))
    close(sway, [0, coefficient * 1.6 * 0.09, 0, 0, 0, 0])
    exact = coefficient * ((0.3 + 0.8 * 0.2) ** 3 - (0.3 - 0.8 * 0.2) ** 3) / (3 * 0.2)  # of (0.3 - 0.2 x)^2
    errors = [abs(float(cross_flow_drag(1.6, 0.19, 0.19, NU, strips=n)[1]) - exact) for n in (10, 20, 40)]
    np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 4.0, rtol=1e-6)


@pytest.mark.full
def test_lift_and_drag():
    close(lift_and_drag(0.19, 0.2128, 0.05596, 0.1, 2.0), golden("forceLiftDrag("))
