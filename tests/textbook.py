"""Formulas of textbooks and the paper that the package does not need: it is tested against them."""

import jax.numpy as jnp

from undertow.core.numerics.rotations import quaternion_from_euler, rotation_from_quaternion, skew


def wrap_angle(angle):
    """Same angle in [-pi, pi), rad."""
    return angle - 2 * jnp.pi * jnp.floor((angle + jnp.pi) / (2 * jnp.pi))


def rotation_from_euler(angles):
    """Rotation body -> world, R(roll, pitch, yaw). Fossen (2.31); upper block of J in Eq. (1)."""
    return rotation_from_quaternion(quaternion_from_euler(angles))


def euler_rate_matrix(angles):
    """T with Euler rates = T (p, q, r); singular at pitch = +-90 deg. Fossen (2.41); lower block of J in Eq. (1)."""
    (sr, sp, _), (cr, cp, _) = jnp.sin(angles), jnp.cos(angles)
    zero, one = jnp.zeros_like(sr), jnp.ones_like(sr)
    return jnp.stack(
        [jnp.stack([one, sr * sp / cp, cr * sp / cp]), jnp.stack([zero, cr, -sr]), jnp.stack([zero, sr / cp, cr / cp])]
    )


def jacobian(angles):
    """J of Eq. (1) as a matrix, from (roll, pitch, yaw)."""
    zero = jnp.zeros((3, 3))
    return jnp.block([[rotation_from_euler(angles), zero], [zero, euler_rate_matrix(angles)]])


def shift_matrix(r):
    """H(r): the velocity at a point at r is H nu; M_b = H^T M H. Fossen (2021), Eq. (C.5)."""
    return jnp.block([[jnp.eye(3), skew(jnp.asarray(r)).T], [jnp.zeros((3, 3)), jnp.eye(3)]])


def coriolis_matrix(mass_matrix, nu):
    """C(nu) from M, skew-symmetric. Fossen (2021), theorem 3.2."""
    momentum = 0.5 * (mass_matrix + mass_matrix.T) @ nu
    linear, angular = skew(jnp.asarray(momentum[:3])), skew(jnp.asarray(momentum[3:]))
    return -jnp.block([[jnp.zeros((3, 3)), linear], [linear, angular]])


def kinetic_energy(body, nu):
    """1/2 nu . M nu of a vehicle, J."""
    return 0.5 * nu @ body.mass_matrix @ nu


def potential_energy(body, position, down):
    """Energy of weight and buoyancy, J; zero with the body upright at the world origin and r_g = r_b = 0."""
    lever = body.weight * body.r_g - body.buoyancy * body.r_b
    return -(body.weight - body.buoyancy) * position[2] - lever @ down


def energy_of_arm(links, q, rate):
    """Kinetic and potential energy of a two-link arm, J."""
    outer = links.outer_mass * links.outer_centre * jnp.sin(q[0] + q[1] - links.outer_offset)
    inner = (links.inner_mass * links.inner_centre + links.outer_mass * links.inner_length) * jnp.sin(q[0])
    return rate @ links.mass_matrix(q) @ rate / 2 + links.gravity * (inner + outer)
