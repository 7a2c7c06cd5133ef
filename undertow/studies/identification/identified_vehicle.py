"""A vehicle whose numbers are those of an estimate, and its motion."""

import abc
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import Water
from undertow.core.measurement import BODY_AXES
from undertow.core.numerics.integrators import rk4
from undertow.core.numerics.linear_algebra import inverse, matvec
from undertow.core.numerics.rotations import quaternion_rate, rotation_from_quaternion
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.thrusters.adjusted import AdjustedThruster, adjusted
from undertow.physics.thrusters.inflow import advance_speed, with_inflow
from undertow.physics.vehicles.body import Body, rigid_body_mass, seen_from_water

Values = Mapping[str, Any]  # of parameters, by name
Push = Float[Array, "6"] | float  # a further acceleration of the body, m/s^2 and rad/s^2

_SMALLEST_INPUT = 1e-6  # below which a power has no slope
_MATRICES = ("added_mass", "linear_damping", "quadratic_damping")


class MotionState(NamedTuple):
    """State of a vehicle and of what drives it."""

    position: Float[Array, "3"]  # m, world
    attitude: Float[Array, "4"]  # unit quaternion, body -> world
    nu: Float[Array, "6"]  # m/s, rad/s, body
    actuators: Any


class AbstractActuation(eqx.Module):
    """What turns the inputs of a log into a force and moment on the body."""

    @abc.abstractmethod
    def initial_state(self) -> Any:
        """At rest."""

    @abc.abstractmethod
    def dynamics(self, state: Any, u: Float[Array, " N"]) -> Any:
        """d(state)/dt."""

    @abc.abstractmethod
    def wrench(self, state: Any, u: Float[Array, " N"], nu: Float[Array, "6"]) -> Float[Array, "6"]:
        """Force and moment on the body, N and N m, at a velocity through the water."""

    @abc.abstractmethod
    def with_values(self, values: Values) -> "AbstractActuation":
        """The same with some of its numbers replaced."""

    @abc.abstractmethod
    def solved(self, state: Any, u: Float[Array, " N"], step: Float[Array, ""]) -> "SolvedStep | None":
        """The states over a step (s) with a held input; None where they have to be integrated."""


class SolvedStep(NamedTuple):
    """States of the actuation over a step, known in closed form."""

    mean: Any
    end: Any


class ThrusterActuation(AbstractActuation):
    """Thrusters that are driven by their inputs."""

    thruster: AdjustedThruster
    thruster_matrix: Float[Array, "6 N"]
    inflow_loss: Float[Array, ""] | None

    def initial_state(self):
        return self.thruster.initial_state(self.thruster_matrix.shape[1])

    def dynamics(self, state, u):
        return self.thruster.dynamics(state, u)

    def wrench(self, state, u, nu):
        thrust = jnp.broadcast_to(self.thruster.thrust(state, u), u.shape)
        if self.inflow_loss is not None:
            thrust = with_inflow(thrust, self.inflow_loss, advance_speed(self.thruster_matrix, nu))
        return matvec(self.thruster_matrix, thrust)

    def solved(self, state, u, step):
        return None

    def with_values(self, values: Values) -> "ThrusterActuation":
        count = self.thruster_matrix.shape[1]
        gains = jnp.stack([jnp.asarray(values.get(f"thruster_gain.T{j + 1}", 1.0)) for j in range(count)])
        thruster = adjusted(
            self.thruster.thruster,
            gain=values.get("thruster_gain", 1.0) * gains,
            reverse_gain=values.get("reverse_gain", 1.0),
            lag=values.get("lag", 1.0),
        )
        return ThrusterActuation(thruster, self.thruster_matrix, self.inflow_loss)


class AxisActuation(AbstractActuation):
    """Inputs that push along the axes with a first-order lag, where it is unknown how they reach the thrusters."""

    gains: Float[Array, "6"]  # N and N m at an input of 1
    lags: Float[Array, "6"]  # s
    power: Float[Array, ""]  # of the input; thrust is nearly quadratic in the command of a speed controller

    def initial_state(self):
        return jnp.zeros(len(BODY_AXES))

    def dynamics(self, state, u):
        return (self._steady(u) - state) / self.lags

    def wrench(self, state, u, nu):
        return state

    def solved(self, state, u, step):
        """However short the lag is beside the step."""
        target = self._steady(u)
        share = -jnp.expm1(-step / self.lags)
        mean = target + (state - target) * share * self.lags / step
        return SolvedStep(mean, state + (target - state) * share)

    def with_values(self, values: Values) -> "AxisActuation":
        return AxisActuation(
            gains=_replaced(self.gains, values, "axis_gain"),
            lags=_replaced(self.lags, values, "axis_lag"),
            power=jnp.asarray(values.get("axis_power", self.power)),
        )

    def _steady(self, u):
        size = jnp.maximum(jnp.abs(u), _SMALLEST_INPUT)
        return self.gains * jnp.sign(u) * size**self.power


class IdentifiedVehicle(eqx.Module):
    """Body, actuation and current of a vehicle."""

    body: Body
    actuation: AbstractActuation

    def advance(
        self, x: MotionState, u: Float[Array, " N"], current: Float[Array, "3"], step, push: Push = 0.0
    ) -> MotionState:
        """State after a step (s) with a held input, and with a push."""
        solved = self.actuation.solved(x.actuators, u, step)
        if solved is None:
            return rk4(lambda t, state: self.dynamics(state, u, current, push), 0.0, x, step)
        still = jax.tree.map(jnp.zeros_like, x.actuators)
        driven = lambda t, state: self.dynamics(state, u, current, push)._replace(actuators=still)
        after = rk4(driven, 0.0, x._replace(actuators=solved.mean), step)
        return after._replace(actuators=solved.end)

    def actuators_after(self, state: Any, u: Float[Array, " N"], step) -> Any:
        """State of the actuation after a step (s), whatever the body does."""
        solved = self.actuation.solved(state, u, step)
        if solved is None:
            return rk4(lambda t, s: self.actuation.dynamics(s, u), 0.0, state, step)
        return solved.end

    def dynamics(
        self, x: MotionState, u: Float[Array, " N"], current: Float[Array, "3"], push: Push = 0.0
    ) -> MotionState:
        """d(state)/dt in water that moves evenly, with the velocity `current` in the world, m/s."""
        rotation = rotation_from_quaternion(x.attitude)
        seen = seen_from_water(Water(current, jnp.zeros(3)), rotation, x.nu, self.body.gravity)
        wrench = self.actuation.wrench(x.actuators, u, seen.nu)
        acceleration = self.body.free_acceleration(seen.nu, seen.down) + seen.rate + self.body.accelerate(wrench) + push
        return MotionState(
            position=matvec(rotation, x.nu[:3]),
            attitude=quaternion_rate(x.attitude, x.nu[3:]),
            nu=acceleration,
            actuators=self.actuation.dynamics(x.actuators, u),
        )


class PriorVehicle(eqx.Module):
    """A vehicle as its file has it, from which those with other numbers are made."""

    mass: Float[Array, ""]
    weight: Float[Array, ""]
    buoyancy: Float[Array, ""]
    r_g: Float[Array, "3"]
    r_b: Float[Array, "3"]
    inertia: Float[Array, "3 3"]
    added_mass: Float[Array, "6 6"]
    linear_damping: Float[Array, "6 6"]
    quadratic_damping: Float[Array, "6 6"]
    actuation: AbstractActuation

    def with_values(self, values: Values) -> IdentifiedVehicle:
        """The vehicle with some of its numbers replaced. The weight follows the mass; the net buoyancy stays."""
        mass = jnp.asarray(values.get("mass", self.mass))
        gravity = self.weight / self.mass
        weight = mass * gravity
        buoyancy = weight + values.get("net_buoyancy", self.buoyancy - self.weight)
        r_b = jnp.stack([jnp.asarray(values.get(f"r_b.{axis}", self.r_b[i])) for i, axis in enumerate("xyz")])
        inertia = self.inertia
        for i, axis in enumerate(("roll", "pitch", "yaw")):
            if f"inertia.{axis}" in values:
                inertia = inertia.at[i, i].set(values[f"inertia.{axis}"])
        added_mass, linear, quadratic = (_matrix(getattr(self, name), values, name) for name in _MATRICES)
        mass_matrix = rigid_body_mass(mass, self.r_g, inertia) + added_mass
        body = Body(
            mass_matrix=mass_matrix,
            inverse_mass_matrix=inverse(mass_matrix),
            linear_damping=linear,
            quadratic_damping=quadratic,
            weight=weight,
            buoyancy=buoyancy,
            r_g=self.r_g,
            r_b=r_b,
            gravity=gravity,
        )
        return IdentifiedVehicle(body, self.actuation.with_values(values))


def prior_vehicle(plant: HybridVehicle, has_axis_inputs: bool = False) -> PriorVehicle:
    """The vehicle of a plant; with inputs along the axes instead of its thrusters, if these are what logs have."""
    vehicle = plant.vehicle
    one = jnp.ones(())
    thrusters = ThrusterActuation(adjusted(plant.thruster), plant.thruster_matrix, plant.inflow_loss)
    axes = AxisActuation(jnp.ones(len(BODY_AXES)), jnp.ones(len(BODY_AXES)), one)
    return PriorVehicle(
        mass=vehicle.mass,
        weight=vehicle.weight,
        buoyancy=vehicle.buoyancy,
        r_g=vehicle.r_g,
        r_b=vehicle.r_b,
        inertia=vehicle.inertia,
        added_mass=vehicle.added_mass,
        linear_damping=vehicle.linear_damping,
        quadratic_damping=vehicle.quadratic_damping,
        actuation=axes if has_axis_inputs else thrusters,
    )


def _matrix(matrix: Float[Array, "6 6"], values: Values, name: str) -> Float[Array, "6 6"]:
    for i, axis in enumerate(BODY_AXES):
        if f"{name}.{axis}" in values:
            matrix = matrix.at[i, i].set(values[f"{name}.{axis}"])
    return matrix


def _replaced(vector: Float[Array, "6"], values: Values, name: str) -> Float[Array, "6"]:
    return jnp.stack([jnp.asarray(values.get(f"{name}.{axis}", vector[i])) for i, axis in enumerate(BODY_AXES)])
