"""Attitude: quaternions for computation, Euler angles for input and output.

Convention of Fossen (2021), "Handbook of Marine Craft Hydrodynamics and Motion Control", ch. 2: body axes
x forward, y starboard, z down; world axes north, east, down; Euler angles (roll, pitch, yaw) in the order
z-y-x; quaternion (w, x, y, z), rotating body vectors into the world.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.linear_algebra import matvec

Vector3 = Float[Array, "3"]
Vector6 = Float[Array, "6"]
Matrix3 = Float[Array, "3 3"]
Quaternion = Float[Array, "4"]

# Permutation symbol: (a x b)_i = e_ijk a_j b_k. One product is one operation for the compiler.
_LEVI_CIVITA = (
    ((0, 0, 0), (0, 0, 1), (0, -1, 0)),
    ((0, 0, -1), (0, 0, 0), (1, 0, 0)),
    ((0, 1, 0), (-1, 0, 0), (0, 0, 0)),
)

# Smallest magnitude of cos(pitch), so that a body passing through the vertical stays finite.
_SMALLEST_COSINE = 1e-12


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Cross product a x b."""
    return (jnp.array(_LEVI_CIVITA, dtype=float) * (a[:, None] * b[None, :])[None]).sum((1, 2))


def skew(a: Vector3) -> Matrix3:
    """Matrix S(a) with S(a) b = a x b."""
    x, y, z = a
    zero = jnp.zeros_like(x)
    return jnp.stack([jnp.stack([zero, -z, y]), jnp.stack([z, zero, -x]), jnp.stack([-y, x, zero])])


def quaternion_from_euler(angles: Vector3) -> Quaternion:
    """Unit quaternion of (roll, pitch, yaw)."""
    return _quaternion_from_halves(jnp.sin(angles / 2), jnp.cos(angles / 2))


def turning_from_euler(angles: Vector3, rates: Vector3, accelerations: Vector3) -> tuple[Quaternion, Vector3, Vector3]:
    """Attitude, body rates (rad/s) and their time derivative of a motion in (roll, pitch, yaw), at any pitch.

    Body rates are T^-1 times the rates of the angles. T^-1 has no singularity, and T is not formed.
    """
    sines, cosines = jnp.sin(angles / 2), jnp.cos(angles / 2)
    (sr, sp, _), (cr, cp, _) = 2 * sines * cosines, cosines**2 - sines**2
    roll_rate, pitch_rate, yaw_rate = rates
    to_body = lambda roll, pitch, yaw: (roll - sp * yaw, cr * pitch + cp * sr * yaw, cp * cr * yaw - sr * pitch)
    p, q, r = to_body(*rates)
    p_dot, q_dot, r_dot = to_body(*accelerations)
    both = pitch_rate * yaw_rate
    turning = (p_dot - cp * both, q_dot + roll_rate * r - sp * sr * both, r_dot - roll_rate * q - sp * cr * both)
    return _quaternion_from_halves(sines, cosines), jnp.stack([p, q, r]), jnp.stack(turning)


def rotation_from_quaternion(q: Quaternion) -> Matrix3:
    """Rotation body -> world. Exact for a unit quaternion; no trigonometry."""
    w, x, y, z = q
    return jnp.stack(
        [
            jnp.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)]),
            jnp.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)]),
            jnp.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]),
        ]
    )


def euler_from_rotation(rotation: Matrix3) -> Vector3:
    """(roll, pitch, yaw) of a rotation, roll and yaw in [-pi, pi], pitch in [-pi/2, pi/2]."""
    level = jnp.sqrt(rotation[2, 1] ** 2 + rotation[2, 2] ** 2)
    return jnp.arctan2(
        jnp.stack([rotation[2, 1], -rotation[2, 0], rotation[1, 0]]), jnp.stack([rotation[2, 2], level, rotation[0, 0]])
    )


def quaternion_rate(q: Quaternion, omega: Vector3) -> Quaternion:
    """Time derivative of q at body rates omega (rad/s), with a correction towards unit length.

    The correction (rate 1/s) vanishes at unit length; it prevents a drift of the length over hours.
    """
    w, x, y, z = q
    p, r, s = omega
    turn = jnp.stack([-x * p - y * r - z * s, w * p + y * s - z * r, w * r + z * p - x * s, w * s + x * r - y * p])
    return 0.5 * turn + 0.5 * (1.0 - (q * q).sum()) * q


def quaternion_product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Product a b: the rotation b, then a."""
    w0, v0, w1, v1 = a[0], a[1:], b[0], b[1:]
    return jnp.concatenate([(w0 * w1 - (v0 * v1).sum())[None], w0 * v1 + w1 * v0 + cross(v0, v1)])


def conjugate(q: Quaternion) -> Quaternion:
    """The inverse of a unit quaternion."""
    return jnp.concatenate([q[:1], -q[1:]])


def quaternion_of_turn(turn: Vector3) -> Quaternion:
    """Unit quaternion of a rotation vector (rad), to the third order: for turns of less than about 0.3 rad."""
    square = (turn * turn).sum()
    q = jnp.concatenate([(1 - square / 8)[None], (0.5 - square / 48) * turn])
    return q / jnp.sqrt((q * q).sum())


def attitude_error(target: Quaternion, actual: Quaternion) -> Vector3:
    """Attitude error sign(q0) 2 q_v of the rotation actual -> target, at most half a turn, in body axes.

    Both signs of either quaternion give the same result, so there is no unwinding.
    """
    w0, v0 = actual[0], actual[1:]
    w1, v1 = target[0], target[1:]
    scalar = w0 * w1 + (v0 * v1).sum()
    vector = w0 * v1 - w1 * v0 - cross(v0, v1)
    return jnp.where(scalar < 0, -2.0, 2.0) * vector


class Kinematics:
    """Jacobian J of Eq. (1), eta_dot = J nu, its inverse and its rate, without forming a 6 x 6 matrix.

    Only the rotation is needed: its third row is (-sin pitch, cos pitch sin roll, cos pitch cos roll).

    Args:
        rotation: body -> world, shape (3, 3).
    """

    def __init__(self, rotation: Matrix3):
        self.rotation = rotation
        self.minus_sin_pitch, *down = rotation[2]
        self.cos_pitch = jnp.sqrt(down[0] ** 2 + down[1] ** 2 + _SMALLEST_COSINE**2)
        self.down = down
        self.secant = 1 / self.cos_pitch
        self.sin_roll, self.cos_roll = down[0] * self.secant, down[1] * self.secant

    def to_world(self, nu: Vector6) -> Vector6:
        """J nu: body rates -> (world velocity, Euler rates)."""
        across = self.sin_roll * nu[4] + self.cos_roll * nu[5]
        return jnp.concatenate(
            [
                matvec(self.rotation, nu[:3]),
                jnp.stack(
                    [
                        nu[3] - self.minus_sin_pitch * self.secant * across,
                        self.cos_roll * nu[4] - self.sin_roll * nu[5],
                        across * self.secant,
                    ]
                ),
            ]
        )

    def to_body(self, rates: Vector6) -> Vector6:
        """J^-1 rates: (world velocity, Euler rates) -> body rates."""
        return jnp.concatenate(
            [
                matvec(self.rotation.T, rates[:3]),
                jnp.stack(
                    [
                        rates[3] + self.minus_sin_pitch * rates[5],
                        self.cos_roll * rates[4] + self.down[0] * rates[5],
                        -self.sin_roll * rates[4] + self.down[1] * rates[5],
                    ]
                ),
            ]
        )

    def rate_term(self, nu: Vector6) -> Vector6:
        """J_dot nu (m/s^2, rad/s^2): the term of Eq. (4) that Remark 2 calls unknown. It is known kinematics."""
        velocity, omega = nu[:3], nu[3:]
        across = self.sin_roll * omega[1] + self.cos_roll * omega[2]
        pitch_rate = self.cos_roll * omega[1] - self.sin_roll * omega[2]
        tan_pitch = -self.minus_sin_pitch * self.secant
        roll_rate = omega[0] + tan_pitch * across
        return jnp.concatenate(
            [
                matvec(self.rotation, cross(omega, velocity)),
                jnp.stack(
                    [
                        pitch_rate * across * self.secant**2 + tan_pitch * roll_rate * pitch_rate,
                        -roll_rate * across,
                        (roll_rate * pitch_rate + tan_pitch * pitch_rate * across) * self.secant,
                    ]
                ),
            ]
        )


def _quaternion_from_halves(sines: Vector3, cosines: Vector3) -> Quaternion:
    """From sines and cosines of half of (roll, pitch, yaw)."""
    (sr, sp, sy), (cr, cp, cy) = sines, cosines
    return jnp.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )
