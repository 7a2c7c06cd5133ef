"""Rigid body in water: M, C(nu) nu, D(nu) nu and g of Eq. (2), in the form of Fossen (2021), ch. 3, 6 and 8."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import Water
from undertow.core.kept_programs import kept_program
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import cross, skew
from undertow.core.param import Param, param

Vector3 = Float[Array, "3"]
Vector6 = Float[Array, "6"]
Matrix6 = Float[Array, "6 6"]


class Body(eqx.Module):
    """Coefficients of the equation of motion about the body origin.

    Body axes forward, starboard, down. Added mass is part of `mass_matrix`; damping matrices are positive.
    """

    mass_matrix: Float[Param, "6 6"] = param("kg, kg m, kg m^2", "mass and added mass", symbol="M")
    inverse_mass_matrix: Float[Param, "6 6"] = param("1/kg, ...", "inverse of the mass matrix", symbol="M^-1")
    linear_damping: Float[Param, "6 6"] = param("N s/m, ...", "linear damping", symbol="D_l")
    quadratic_damping: Float[Param, "6 6"] = param("N s^2/m^2, ...", "quadratic damping", symbol="D_q")
    weight: Float[Param, ""] = param("N", "weight", symbol="W")
    buoyancy: Float[Param, ""] = param("N", "buoyancy", symbol="B")
    r_g: Float[Param, "3"] = param("m", "centre of gravity", symbol="r_g")
    r_b: Float[Param, "3"] = param("m", "centre of buoyancy", symbol="r_b")
    gravity: Float[Param, ""] = param("m/s^2", "gravity, weight per dry mass", symbol="g", default=9.81)

    def coriolis(self, nu: Vector6) -> Vector6:
        """C(nu) nu, N and N m."""
        return coriolis_force(self.mass_matrix, nu)

    def damping(self, nu: Vector6) -> Vector6:
        """D(nu) nu = D_l nu + D_q (|nu| nu), N and N m."""
        return matvec(self.linear_damping, nu) + matvec(self.quadratic_damping, jnp.abs(nu) * nu)

    def restoring(self, down: Vector3) -> Vector6:
        """g, N and N m, on the left side of Eq. (2).

        Args:
            down: direction of gravity in body axes: third row of R in water that does not accelerate.
        """
        force = (self.weight - self.buoyancy) * down
        moment = cross(self.weight * self.r_g - self.buoyancy * self.r_b, down)
        return -jnp.concatenate([force, moment])

    def free_acceleration(self, nu: Vector6, down: Vector3) -> Vector6:
        """M^-1 (-C(nu) nu - D(nu) nu - g): body acceleration without thrust, m/s^2 and rad/s^2."""
        return self.accelerate(-self.coriolis(nu) - self.damping(nu) - self.restoring(down))

    def accelerate(self, wrench: Vector6) -> Vector6:
        """M^-1 wrench, m/s^2 and rad/s^2."""
        return matvec(self.inverse_mass_matrix, wrench)


def coriolis_force(mass_matrix: Matrix6, nu: Vector6) -> Vector6:
    """C(nu) nu, N and N m, which does no work: nu . C(nu) nu = 0. Fossen (2021), theorem 3.2, expanded."""
    momentum = matvec(mass_matrix, nu)
    linear, angular = momentum[:3], momentum[3:]
    return jnp.concatenate([cross(nu[3:], linear), cross(nu[:3], linear) + cross(nu[3:], angular)])


@kept_program
def rigid_body_mass(mass: Array, r_g: Vector3, inertia: Float[Array, "3 3"]) -> Matrix6:
    """M_RB about the body origin. Fossen (2021), Eq. (3.49).

    Args:
        mass: kg.
        r_g: centre of gravity, m.
        inertia: about the body origin, kg m^2.
    """
    lever = mass * skew(r_g)
    return jnp.block([[mass * jnp.eye(3), -lever], [lever, inertia]])


class SeenFromWater(NamedTuple):
    """Arguments of the equation of motion relative to the water, body axes."""

    nu: Vector6  # velocity through the water, m/s, rad/s
    down: Vector3  # apparent gravity, in units of gravity
    rate: Vector6 | Float[Array, ""]  # nu_dot less that of the velocity through the water, m/s^2


def seen_from_water(
    water: Water | None, rotation: Float[Array, "3 3"], nu: Vector6, gravity: Float[Array, ""]
) -> SeenFromWater:
    """Motion of the body relative to the water around it, Fossen (2021), ch. 10.3.

    Where the water is uniform over the body, it is at rest in axes that move with it. An acceleration of the water
    acts in these axes as a change of gravity on the mass of the body and on the displaced water.

    Args:
        water: motion of the water, world axes; None for water at rest.
        rotation: body -> world.
        nu: body velocity over ground, m/s and rad/s.
        gravity: m/s^2.
    """
    if water is None:
        return SeenFromWater(nu, rotation[2], jnp.zeros(()))
    flow = matvec(rotation.T, water.velocity)
    acceleration = matvec(rotation.T, water.acceleration)
    rest = jnp.zeros(3)
    return SeenFromWater(
        nu=nu - jnp.concatenate([flow, rest]),
        down=rotation[2] - acceleration * (1 / gravity),
        rate=jnp.concatenate([acceleration - cross(nu[3:], flow), rest]),
    )
