"""Nominal model of a vehicle with thrusters: F, G and the inverse of G, Eq. (17)."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.arrays import as_array, library_of
from undertow.core.contracts import AbstractCoordinates, AbstractDynamics, Measurement, Model, Target, TrackingError
from undertow.core.coordinates import AbstractOutputCoordinates
from undertow.core.measurement import BODY_AXES, body_of, measurement_of_outputs
from undertow.core.numerics.linear_algebra import matvec, partial_inverse, printed_inverse, regularised_sharp
from undertow.core.numerics.rotations import (
    Kinematics,
    attitude_error,
    cross,
    rotation_from_quaternion,
    turning_from_euler,
)
from undertow.core.parametric_dynamics import AbstractParametricDynamics, Parametrization
from undertow.core.status import Status
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.physics.vehicles.body import Body

Vector6 = Float[Array, "6"]

EULER_ANGLES = (False, False, False, True, True, True)


# Largest plausible deviations from a nominal body: of inertia (factor), drag (1/s, 1/m), weight and loads (m/s^2,
# rad/s^2); drag and loads are per inertia of their axis.
_INERTIA, _LINEAR, _QUADRATIC, _WEIGHT = 0.5, 1.0, 2.0, 1.0
_LOADS = (5.0, 5.0, 5.0, 50.0, 50.0, 50.0)

# Heave, roll and pitch learn a constant load twice: along the axes of the body and along gravity.
_SHARES = (1.0, 1.0, 0.5, 0.5, 0.5, 1.0)


class BodyDynamics(AbstractParametricDynamics):
    """nu_dot = F + M^-1 B f + d with f the thrusts, N: section X5 of the theory. J and J_dot do not appear.

    Its 28 parameters: factors of the inertia of each axis (6), additional linear (6) and quadratic (6) drag, error of
    the weight (1) and of the moments of weight and buoyancy (3), and a constant load of each axis (6).
    """

    body: Body
    acceleration_per_thrust: Float[Array, "6 N"]  # M^-1 B
    allocation: Float[Array, "N 6"]  # inverse of M^-1 B; accelerations that the thrusters cannot give are ignored

    def drift(self, y: Measurement) -> Vector6:
        own = body_of(y)
        return self.body.free_acceleration(own.nu, own.rotation[2])

    def gain(self, y: Measurement) -> Float[Array, "6 N"]:
        return self.acceleration_per_thrust

    def invert(self, y: Measurement, acceleration: Vector6) -> Float[Array, " N"]:
        return matvec(self.allocation, acceleration)

    def parametrization(self) -> Parametrization:
        inertia = jnp.diagonal(self.body.mass_matrix)
        one, most, share = jnp.ones(6), jnp.asarray(_LOADS), jnp.asarray(_SHARES)
        join = lambda *parts: jnp.concatenate([jnp.atleast_1d(part) for part in parts])
        weight, moments, loads = inertia[:3].mean(), inertia[3:], inertia
        return Parametrization(
            nominal=join(one, jnp.zeros(22)),
            most=join(
                _INERTIA * one, _LINEAR * loads, _QUADRATIC * loads, _WEIGHT * weight, most[3:] * moments, most * loads
            ),
            rates=join(one / inertia, loads, loads, weight / 2, moments / 2, share * loads),
            inertia=inertia,
        )

    def generalized_force(self, y: Measurement, parameters, velocity: Vector6, acceleration: Vector6) -> Vector6:
        """M a + C(nu) v + D(nu) v + g: C is linear in M, and skew-symmetric."""
        own = body_of(y)
        factor, linear, quadratic, weight, moment, load = jnp.split(parameters, (6, 12, 18, 19, 22))
        mass, down, speed = self.body.mass_matrix, own.rotation[2], jnp.abs(own.nu)
        moved = lambda motion: (factor * matvec(mass, motion) + matvec(mass, factor * motion)) / 2
        momentum = moved(own.nu)
        turned = jnp.concatenate(
            [cross(velocity[3:], momentum[:3]), cross(velocity[:3], momentum[:3]) + cross(velocity[3:], momentum[3:])]
        )
        drag = matvec(self.body.linear_damping, velocity) + matvec(self.body.quadratic_damping, speed * velocity)
        more_drag = (linear + quadratic * speed) * velocity
        static = self.body.restoring(down) - jnp.concatenate([weight * down, cross(moment, down)]) + load
        return moved(acceleration) + turned + drag + more_drag + static

    def accelerated_by(self, y: Measurement, force: Vector6) -> Vector6:
        return self.body.accelerate(force)


class BodyCoordinates(AbstractCoordinates):
    """Errors in body axes: position (m), attitude as a rotation vector (rad) of at most half a turn; velocity nu."""

    angles: tuple[bool, ...] = eqx.field(static=True, default=EULER_ANGLES)
    tolerated_status: tuple[Status, ...] = eqx.field(static=True, default=(Status.PITCH_SINGULAR,))
    axes: tuple[str, ...] = eqx.field(static=True, default=BODY_AXES)

    def measurement(self, position: Vector6, velocity: Vector6, actuator: Any = None) -> Measurement:
        return measurement_of_outputs(position, velocity, actuator)

    def tracking_error(self, y: Measurement, r: Target) -> TrackingError:
        """Target relative to the vehicle in body axes: error, velocity and the time derivative of the velocity."""
        own = body_of(y)
        to_body = own.rotation.T
        attitude, rate, turning = turning_from_euler(r.position[3:], r.velocity[3:], r.acceleration[3:])
        between = to_body @ rotation_from_quaternion(attitude)
        rate, turning = matvec(between, rate), matvec(between, turning)
        velocity = matvec(to_body, r.velocity[:3])
        acceleration = matvec(to_body, r.acceleration[:3]) - cross(own.nu[3:], velocity)
        there = matvec(to_body, r.position[:3] - y.position[:3])
        return TrackingError(
            error=jnp.concatenate([there, attitude_error(attitude, own.attitude)]),
            rate=jnp.concatenate([velocity, rate]) - own.nu,
            acceleration=jnp.concatenate([acceleration, turning - cross(own.nu[3:], rate)]),
        )

    def velocity(self, y: Measurement) -> Vector6:
        return body_of(y).nu

    def with_velocity(self, y: Measurement, velocity: Vector6) -> Measurement:
        own = body_of(y)
        return y._replace(velocity=Kinematics(own.rotation).to_world(velocity), body=own._replace(nu=velocity))

    def acceleration(self, y: Measurement, acceleration: Vector6) -> Vector6:
        """nu_dot that belongs to an acceleration of the outputs."""
        own = body_of(y)
        kinematics = Kinematics(own.rotation)
        return kinematics.to_body(acceleration - kinematics.rate_term(own.nu))

    def output_velocity(self, y: Measurement, velocity: Vector6) -> Vector6:
        return Kinematics(body_of(y).rotation).to_world(velocity)

    def in_body_axes(self, dynamics: AbstractDynamics) -> None:
        return None


class HybridDynamics(AbstractDynamics):
    """x_ddot = F + G V + d, Eq. (17), in Euler angles; valid for |pitch| < 90 deg. The forces f are voltages."""

    body: Body
    thruster: AbstractThruster
    thruster_matrix: Float[Array, "6 N"]
    body_gain: Float[Array, "6 N"]  # M^-1 B alpha
    allocation: Float[Array, "N 6"]  # (B alpha)+
    wrenches: Float[Array, "6 r"] | None  # orthonormal basis of those that the thrusters can give; None for all
    regularisation: float | None
    rank: int = eqx.field(static=True)
    speed_sensor: bool = eqx.field(static=True)
    rate_term: bool = eqx.field(static=True)

    def drift(self, y: Measurement) -> Float[Array, "6"]:
        """F of Eq. (17): J M^-1 (-C nu - D nu - g), with J M^-1 B phi if speeds are measured."""
        moving = body_of(y)
        kinematics, nu = Kinematics(moving.rotation), moving.nu
        own = self.body.free_acceleration(nu, kinematics.rotation[2])
        if self.speed_sensor:
            phi = self.thruster.speed_term(y.actuator)
            phi = jnp.broadcast_to(phi, self.thruster_matrix.shape[1:])
            own = own + self.body.accelerate(matvec(self.thruster_matrix, phi))
        drift = kinematics.to_world(own)
        return drift + kinematics.rate_term(nu) if self.rate_term else drift

    def gain(self, y: Measurement) -> Float[Array, "6 N"]:
        """G = J M^-1 B alpha of Eq. (17); equal to M_J^-1 J^-T B alpha."""
        return jax.vmap(Kinematics(body_of(y).rotation).to_world, in_axes=1, out_axes=1)(self.body_gain)

    def invert(self, y: Measurement, acceleration: Float[Array, "6"]) -> Float[Array, " N"]:
        """V = G# acceleration, Eq. (23).

        At rank 6 the inverse has a closed form, G+ = (B alpha)+ M J^-1 with a constant first factor, so that the loop
        factorises nothing. Below rank 6 it is the Moore-Penrose inverse of G = H U^T B alpha, which is (B alpha)+ U H+:
        U is a basis of the wrenches that the thrusters can give, and H = J M^-1 U their accelerations, of full column
        rank. With a regularisation it is Eq. (27).
        """
        if self.regularisation is not None:
            return matvec(regularised_sharp(self.gain(y), self.regularisation), acceleration)
        kinematics = Kinematics(body_of(y).rotation)
        if self.wrenches is None:
            return matvec(self.allocation, matvec(self.body.mass_matrix, kinematics.to_body(acceleration)))
        effect = jax.vmap(kinematics.to_world, in_axes=1, out_axes=1)(self.body.inverse_mass_matrix @ self.wrenches)
        return matvec(self.allocation, matvec(self.wrenches, matvec(printed_inverse(effect), acceleration)))


class EulerCoordinates(AbstractOutputCoordinates):
    """North, east, down and Euler angles, as in the paper."""

    angles: tuple[bool, ...] = eqx.field(static=True, default=EULER_ANGLES)
    tolerated_status: tuple[Status, ...] = eqx.field(static=True, default=())
    axes: tuple[str, ...] = eqx.field(static=True, default=())

    def measurement(self, position, velocity, actuator: Any = None) -> Measurement:
        return measurement_of_outputs(position, velocity, actuator)

    def in_body_axes(self, dynamics: Any) -> Model:
        """The same model in body axes, with the thrusters' motors; speeds are measured if `speed_sensor`.

        Of a non-affine model, the affine one: the curve of the thrusters is in the model of the actuators.
        """
        dynamics = getattr(dynamics, "affine", dynamics)
        body, matrix = dynamics.body, dynamics.thruster_matrix
        effect = body.inverse_mass_matrix @ matrix
        library = library_of(body.mass_matrix)
        # Accelerations of equal kinetic energy.
        alike = as_array(1 / library.sqrt(library.diagonal(body.mass_matrix)))
        return Model(
            BodyDynamics(body, effect, partial_inverse(effect, alike, dynamics.rank)),
            BodyCoordinates(),
            dynamics.thruster.actuator_model(matrix.shape[1], dynamics.speed_sensor),
        )
