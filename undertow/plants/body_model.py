"""What a controller may know of a vehicle, in body axes: no Euler angles inside, so no singularity and no unwinding."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import AbstractModel, Measurement, Target
from undertow.core.status import Status
from undertow.numerics.linear import matvec
from undertow.numerics.rotations import (
    attitude_error,
    cross,
    kinematics_from_euler,
    quaternion_from_euler,
    rotation_from_quaternion,
)
from undertow.vehicles.body import Body

Vector6 = Float[Array, "6"]


class BodyModel(AbstractModel):
    """nu_dot = F + M^-1 B f + d with f the thrusts, N: section X5 of the theory. J and J_dot do not appear.

    Euler angles come in with the measurement and go no further than the rotation that they stand for. `gain` and
    `invert` are those of thrusters that follow T = alpha V, as in the paper.
    """

    body: Body
    thrusters: AbstractActuatorModel
    acceleration_per_thrust: Float[Array, "6 N"]  # M^-1 B
    allocation: Float[Array, "N 6"]  # inverse of M^-1 B; what no thruster can give is not asked for
    thrust_per_volt: Float[Array, " N"]  # alpha
    angles: tuple[bool, ...] = eqx.field(static=True, default=(False, False, False, True, True, True))

    def actuators(self) -> AbstractActuatorModel:
        return self.thrusters

    def tolerated_status(self) -> tuple[Status, ...]:
        return (Status.PITCH_SINGULAR,)

    def error(self, y: Measurement, r: Target) -> Vector6:
        """Position error in body axes (m), attitude error as a rotation vector (rad), the short way round."""
        wanted, actual = quaternion_from_euler(r.position[3:]), quaternion_from_euler(y.position[3:])
        there = matvec(rotation_from_quaternion(actual).T, r.position[:3] - y.position[:3])
        return jnp.concatenate([there, attitude_error(wanted, actual)])

    def rates(self, y: Measurement) -> Vector6:
        """nu."""
        return kinematics_from_euler(y.position[3:]).to_body(y.velocity)

    def output_rates(self, y: Measurement, rates: Vector6) -> Vector6:
        return kinematics_from_euler(y.position[3:]).to_world(rates)

    def desired_motion(self, y: Measurement, r: Target) -> tuple[Vector6, Vector6]:
        """nu of the target as the vehicle sees it in its own axes, and its time derivative."""
        own, other = kinematics_from_euler(y.position[3:]), kinematics_from_euler(r.position[3:])
        rates, nu = own.to_body(y.velocity)[3:], other.to_body(r.velocity)
        turning = other.to_body(r.acceleration - other.rate_term(nu))[3:]
        between = own.rotation.T @ other.rotation
        rate, turning = matvec(between, nu[3:]), matvec(between, turning)
        velocity = matvec(own.rotation.T, r.velocity[:3])
        acceleration = matvec(own.rotation.T, r.acceleration[:3]) - cross(rates, velocity)
        return jnp.concatenate([velocity, rate]), jnp.concatenate([acceleration, turning - cross(rates, rate)])

    def rates_derivative(self, y: Measurement, acceleration: Vector6) -> Vector6:
        """nu_dot of an acceleration of the outputs."""
        kinematics = kinematics_from_euler(y.position[3:])
        return kinematics.to_body(acceleration - kinematics.rate_term(kinematics.to_body(y.velocity)))

    def drift(self, y: Measurement) -> Vector6:
        kinematics = kinematics_from_euler(y.position[3:])
        return self.body.free_acceleration(kinematics.to_body(y.velocity), kinematics.rotation[2])

    def acceleration_per_force(self, y: Measurement) -> Float[Array, "6 N"]:
        return self.acceleration_per_thrust

    def force_for(self, y: Measurement, acceleration: Vector6) -> Float[Array, " N"]:
        return matvec(self.allocation, acceleration)

    def gain(self, y: Measurement) -> Float[Array, "6 N"]:
        return self.acceleration_per_thrust * self.thrust_per_volt

    def invert(self, y: Measurement, acceleration: Vector6) -> Float[Array, " N"]:
        return self.force_for(y, acceleration) / self.thrust_per_volt
