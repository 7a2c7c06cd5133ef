"""Matrices that the sources print, against those that follow from poses and coefficients."""

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.physics.vehicles import bluerov2, bluerov2_heavy, npsauv2, rexrov

# uuvsimulator/uuv_simulator@bfb40cb, TAM.yaml, rows Y, Z, M, N negated (forward, port, up -> forward, starboard, down).
REXROV = np.array(
    [
        [0.15974269, 0.15974269, -0.15974243, -0.15974243, 0.70710686, 0.70710686, -0.70710654, -0.70710654],
        [0.21361012, -0.21361012, 0.21360977, -0.21360977, -0.70710670, 0.70710670, -0.70710702, 0.70710702],
        [-0.96377020, -0.96377020, -0.96377032, -0.96377032, 0, 0, 0, 0],
        [0.43523203, -0.43523203, 0.43523188, -0.43523188, -0.09121676, 0.09121676, -0.09121681, 0.09121681],
        [-0.94309350, -0.94309350, 0.94309347, 0.94309347, -0.09121679, -0.09121679, 0.09121674, 0.09121674],
        [-0.13688862, 0.13688862, 0.13688840, -0.13688840, 0.64879876, -0.64879876, -0.64879873, 0.64879873],
    ]
)
REXROV_RPY = [[0, -74.53, -53.21], [0, -74.53, 53.21], [0, -105.47, 53.21], [0, -105.47, -53.21]]
REXROV_RPY += [[0, 0, 45], [0, 0, -45], [0, 0, 135], [0, 0, -135]]  # degrees, forward, port, up

# HKPolyU-UAV/bluerov2@371f35d, TAM.yaml, the same rows negated.
HKPOLYU = np.array(
    [
        [0.70710678, 0.70710678, -0.70710678, -0.70710678, 0, 0],
        [-0.70710678, 0.70710678, -0.70710678, 0.70710678, 0, 0],
        [0, 0, 0, 0, -1, -1],
        [0.05126524, -0.05126524, 0.05126524, -0.05126524, -0.1105, 0.1105],
        [0.05126524, 0.05126524, -0.05126524, -0.05126524, 0.0025, 0.0025],
        [-0.16652365, 0.16652365, 0.17500893, -0.17500893, 0, 0],
    ]
)

# OsloMet-OceanLab/BlueROV2@a536a75, BlueRov_m_script.m, tau_k, and the digits that each row has.
WU = np.array(
    [
        [0.707, 0.707, -0.707, -0.707, 0, 0, 0, 0],
        [-0.707, 0.707, -0.707, 0.707, 0, 0, 0, 0],
        [0, 0, 0, 0, -1, 1, 1, -1],
        [0.06, -0.06, 0.06, -0.06, -0.218, -0.218, 0.218, 0.218],
        [0.06, 0.06, -0.06, -0.06, 0.120, -0.120, 0.120, -0.120],
        [-0.1888, 0.1888, 0.1888, -0.1888, 0, 0, 0, 0],
    ]
)
WU_HALF_DIGIT = np.array(
    [[5e-4] * 8, [5e-4] * 8, [0.0] * 8, [5e-3] * 4 + [5e-4] * 4, [5e-3] * 4 + [5e-4] * 4, [5e-5] * 8]
)

# ArduPilot AP_Motors6DOF.cpp, motor factors (forward, lateral, throttle, roll, pitch, yaw) of positive output.
ARDUSUB_HEAVY = np.array(
    [
        [-1, -1, 1, 1, 0, 0, 0, 0],
        [1, -1, 1, -1, 0, 0, 0, 0],
        [0, 0, 0, 0, -1, -1, -1, -1],
        [0, 0, 0, 0, 1, -1, 1, -1],
        [0, 0, 0, 0, -1, -1, 1, 1],
        [1, -1, -1, 1, 0, 0, 0, 0],
    ]
)
ARDUSUB_STANDARD = np.concatenate(
    [ARDUSUB_HEAVY[:, :4], np.array([[0, 0], [0, 0], [-1, -1], [1, -1], [0, 0], [0, 0]])], axis=1
)

# SIAEthen/simurv_unicas@ff4d0a1, func/InverseDynamics_vehicle.m, M of the NPS AUV II; its entries below 0.02 are zeros.
SIMURV = np.array(
    [
        [6.019e3, 0, 0, 0, 3.325e2, 0],
        [0, 9.551e3, 0, -3.802e2, 0, -4.736e2],
        [0, 0, 2.332e4, 0, 2.683e3, 0],
        [0, -3.802e2, 0, 4.129e3, 1.358e1, 8.467e1],
        [3.325e2, 0, 2.683e3, 1.358e1, 4.913e4, 1.357e1],
        [0, -4.736e2, 0, 8.467e1, 1.357e1, 2.069e4],
    ]
)


def test_rexrov_thruster_matrix():
    np.testing.assert_allclose(rexrov().thruster_matrix(), REXROV, rtol=0, atol=1e-7)


def test_rexrov_thrusters_point_where_the_drawing_says():
    """Local x axis, yawed and pitched. Two sizes of tolerance: the source's degree is 0.01745329 rad, so that its
    directions, which undertow keeps, are off by 2.4e-7; a degree with all digits is what the angles mean.
    """
    _, pitch, yaw = np.radians(REXROV_RPY).T
    axes = np.stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)], axis=1)
    difference = np.abs(np.asarray(rexrov().thruster_directions) - axes * [1, -1, -1]).max()
    assert 2.3e-7 < difference < 2.5e-7


def test_hkpolyu_thruster_matrix():
    np.testing.assert_allclose(bluerov2(layout="hkpolyu").thruster_matrix(), HKPOLYU, rtol=0, atol=5.1e-9)


def test_wu_thruster_matrix_to_its_printed_digits():
    difference = np.abs(np.asarray(bluerov2_heavy(layout="wu2018").thruster_matrix()) - WU)
    assert (difference <= WU_HALF_DIGIT).all()


@pytest.mark.parametrize(
    "matrix, factors, turned",
    [
        (bluerov2_heavy(layout="ardusub_gazebo").thruster_matrix(), ARDUSUB_HEAVY, []),
        (bluerov2(layout="ignition").thruster_matrix(), ARDUSUB_STANDARD, [4, 5]),
    ],
    ids=["heavy", "standard"],
)
def test_signs_of_ardusub(matrix, factors, turned):
    """Throttle is up; undertow turns the verticals of the standard vehicle round."""
    ours = np.sign(np.round(np.asarray(matrix), 9)) * np.array([[1], [1], [-1], [1], [1], [1]])
    ours[:, turned] *= -1
    np.testing.assert_array_equal(ours, factors)


def test_npsauv2_mass_matrix():
    """Every entry to 7.4e-4, which is more than the four printed digits: -13.58 is in it as 13.57, and so on."""
    found = np.asarray(npsauv2("antonelli_simurv").mass_matrix())
    np.testing.assert_array_equal(found[SIMURV == 0], 0)
    relative = found[SIMURV != 0] / SIMURV[SIMURV != 0] - 1
    assert np.abs(relative).max() == pytest.approx(7.4e-4, abs=5e-6)


def test_rexrov_added_mass_is_as_printed_but_for_one_entry():
    """10.774 opposite 10.775; the mean is taken."""
    added_mass = rexrov("berg2012").added_mass
    assert float(added_mass[2, 5]) == float(added_mass[5, 2]) == 10.7745
    assert jnp.array_equal(added_mass[0], jnp.array([779.79, -6.8773, -103.32, 8.5426, -165.54, -7.8033]))
