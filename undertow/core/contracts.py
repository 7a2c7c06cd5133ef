"""The contracts: pure functions on pytrees, SI units, t in s.

Objects hold parameters only; state goes in and comes out. A class is either abstract (never made) or final
(never inherited from).
"""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray, PyTree

from undertow.core.actuator_model import AbstractActuatorModel, DirectActuator
from undertow.core.arrays import as_array
from undertow.core.runtime import double_outside_runs
from undertow.core.signals import Signal
from undertow.core.status import Status
from undertow.numerics.linear import matvec

Time = Float[Array, ""]
Outputs = Float[Array, " n"]
Inputs = Float[Array, " m"]
Gain = Float[Array, "n m"]


class Measurement(NamedTuple):
    """What is measured of a plant: y; the state X of Eq. (18)."""

    position: Outputs  # m, rad
    velocity: Outputs  # m/s, rad/s
    actuator: Any = None  # whatever else the actuators report; None when nothing


class Target(NamedTuple):
    """What is wanted of a plant: r (position, velocity, acceleration)."""

    position: Outputs
    velocity: Outputs
    acceleration: Outputs


class Pose(NamedTuple):
    """Where a body is and how it moves, for loads that depend on it. World axes north, east, down."""

    position: Float[Array, "3"]  # m
    rotation: Float[Array, "3 3"]  # body -> world
    velocity: Float[Array, "3"]  # m/s


class Water(NamedTuple):
    """How the water moves where the body is, as if the body were not there. World axes."""

    velocity: Float[Array, "3"]  # m/s
    acceleration: Float[Array, "3"]  # m/s^2


class ModelScaling(NamedTuple):
    """By how much the true body differs from the one the controller was told: factors, 1 for not at all."""

    mass: Float[Array, ""]  # on M, and with it on C
    damping: Float[Array, ""]  # on D
    restoring: Float[Array, ""]  # on g
    thrust: Float[Array, ""]  # on what every thruster gives


class Payload(NamedTuple):
    """A point mass carried along."""

    mass: Float[Array, ""]  # kg
    weight: Float[Array, ""]  # N, in water
    point: Float[Array, "3"]  # m, body axes


class Load(NamedTuple):
    """What the surroundings do to a plant. Loads add; None and () stand for nothing and cost nothing."""

    acceleration: Outputs  # lumped, added to x_ddot; m/s^2, rad/s^2
    wrench: Outputs  # w_d of Eq. (2), on the left side: it opposes; N, N m (body axes for a vehicle)
    water: Water | None = None
    scaling: ModelScaling | None = None
    payloads: tuple[Payload, ...] = ()


class Effort(NamedTuple):
    """What driving the actuators costs."""

    power: Inputs  # electrical power drawn, W
    saturated: Inputs  # 1 where an input is at its limit, else 0


class AbstractModel(eqx.Module):
    """What a controller may know of a plant: x_ddot = F + G u (+ d, unknown). Eq. (17)."""

    angles: eqx.AbstractVar[tuple[bool, ...]]  # which outputs are angles, to be compared modulo 2 pi

    @abc.abstractmethod
    def drift(self, y: Measurement) -> Outputs:
        """F, m/s^2 and rad/s^2."""

    @abc.abstractmethod
    def gain(self, y: Measurement) -> Gain:
        """G, per unit of input."""

    @abc.abstractmethod
    def invert(self, y: Measurement, acceleration: Outputs) -> Inputs:
        """u with G u = acceleration as nearly as the plant allows: G# of Eqs. (22)-(27)."""

    def actuators(self) -> AbstractActuatorModel:
        """What stands between input and force; G is per unit of input unless a model says otherwise."""
        return DirectActuator()

    def acceleration_per_force(self, y: Measurement) -> Gain:
        """Acceleration per force of the drive: x_ddot = F + effect force + d."""
        return self.gain(y)

    def force_for(self, y: Measurement, acceleration: Outputs) -> Inputs:
        """Smallest forces of the drive with effect force = acceleration, as nearly as possible."""
        return self.invert(y, acceleration)

    # The coordinates of the law. They are the outputs themselves unless a model has better ones, such as body axes.

    def error(self, y: Measurement, r: Target) -> Outputs:
        """How far the target is, m and rad."""
        return self.difference(r.position, y.position)

    def rates(self, y: Measurement) -> Outputs:
        """Velocity, m/s and rad/s."""
        return y.velocity

    def output_rates(self, y: Measurement, rates: Outputs) -> Outputs:
        """Velocity of the outputs for given `rates`, or any small motion likewise."""
        return rates

    def desired_motion(self, y: Measurement, r: Target) -> tuple[Outputs, Outputs]:
        """Velocity of the target and its time derivative."""
        return r.velocity, r.acceleration

    def rates_derivative(self, y: Measurement, acceleration: Outputs) -> Outputs:
        """Time derivative of `rates` for a second derivative of the outputs."""
        return acceleration

    def tolerated_status(self) -> tuple[Status, ...]:
        """Conditions of the plant under which a run goes on, because these coordinates are not touched by them."""
        return ()

    def in_body_axes(self) -> "AbstractModel":
        """This model in the coordinates that suit the plant best; itself where there are no better ones."""
        return self

    def difference(self, target: Outputs, actual: Outputs) -> Outputs:
        """target - actual, angles the short way round."""
        turn = 2 * jnp.pi * jnp.asarray(self.angles, dtype=float)
        raw = target - actual
        return raw - turn * jnp.round(raw / (2 * jnp.pi))


class AbstractPlant(eqx.Module):
    """A second-order control-affine system with n outputs and m inputs, Eq. (20)."""

    outputs: eqx.AbstractVar[tuple[str, ...]]  # names of the n outputs
    output_units: eqx.AbstractVar[tuple[str, ...]]
    input_unit: eqx.AbstractVar[str]

    def __init_subclass__(cls, **options: Any):
        super().__init_subclass__(**options)
        if "model" in vars(cls):  # its numbers are made where a plant's own are, before any run
            cls.model = double_outside_runs(cls.model)

    @abc.abstractmethod
    def initial_state(self, position: Outputs | None = None, velocity: Outputs | None = None) -> PyTree:
        """State x with given outputs (zero where None), actuators at rest."""

    @abc.abstractmethod
    def dynamics(self, t: Time, x: PyTree, u: Inputs, d: Load) -> PyTree:
        """dx/dt."""

    @abc.abstractmethod
    def output(self, t: Time, x: PyTree) -> Measurement:
        """y, without error."""

    @abc.abstractmethod
    def acceleration(self, t: Time, x: PyTree, u: Inputs, d: Load) -> Outputs:
        """x_ddot of the outputs, m/s^2 and rad/s^2."""

    @abc.abstractmethod
    def pose(self, x: PyTree) -> Pose | None:
        """Where the body is; None for plants that are not bodies in water."""

    @abc.abstractmethod
    def admissible(self, x: PyTree, u: Inputs) -> Inputs:
        """What reaches the actuators when u is commanded in state x (limits)."""

    @abc.abstractmethod
    def effort(self, x: PyTree, u: Inputs) -> Effort:
        """What applying u costs."""

    @abc.abstractmethod
    def inputs(self) -> int:
        """Number m of inputs."""

    @abc.abstractmethod
    def status(self, x: PyTree) -> Array:
        """Status code of a state; `Status.OK` as long as it means anything."""

    @abc.abstractmethod
    def advice(self) -> tuple[str, ...]:
        """What a user should know before running this plant; each with the numbers that caused it."""

    @abc.abstractmethod
    def model(self) -> AbstractModel:
        """What a controller is told of this plant; keyword arguments with defaults are the scenario's `model`."""

    def diagnostics(self, x: PyTree, u: Inputs) -> dict[str, Array]:
        """Values of the signals that this plant declares, by name."""
        return {}

    def signals(self) -> dict[str, Signal]:
        """What is recorded of this plant alone, by name: each entry of `diagnostics`."""
        return {}

    def no_load(self) -> Load:
        """Load of load surroundings."""
        zero = jnp.zeros(len(self.outputs))
        return Load(zero, zero)


class AbstractController(eqx.Module):
    """A law. `command` before `advance`: the input leaves first, and adaptation sees what was applied."""

    model: eqx.AbstractVar[AbstractModel]

    @abc.abstractmethod
    def init(self, y: Measurement, r: Target) -> PyTree:
        """State z before the first measurement is used."""

    @abc.abstractmethod
    def command(self, z: PyTree, y: Measurement, r: Target) -> tuple[Inputs, dict[str, Array]]:
        """Input u, and the values of the declared signals by name. Nothing of them is carried.

        A signal `estimate` is what the law believes of d; it is used where a reading is no number.
        """

    @abc.abstractmethod
    def advance(self, z: PyTree, y: Measurement, r: Target, u_applied: Inputs, dt: Time) -> PyTree:
        """State one sampling time later."""

    def known_acceleration(self, z: PyTree, y: Measurement, u_applied: Inputs) -> Outputs:
        """F + G u: what the law takes for granted of the acceleration; d is all the rest."""
        return self.model.drift(y) + matvec(self.model.gain(y), u_applied)

    @abc.abstractmethod
    def signals(self) -> dict[str, Signal]:
        """What `command` lets one look at, by name; {} for nothing."""


class AbstractDisturbance(eqx.Module):
    """A load drawn once from a key; afterwards a function of time."""

    @abc.abstractmethod
    def realize(self, key: PRNGKeyArray) -> PyTree:
        """Path: everything random about one realisation."""

    @abc.abstractmethod
    def at(self, realization: PyTree, t: Time, pose: Pose | None, load: Load) -> Load:
        """`load`, which is what the surroundings do without this disturbance, with it added, at time t."""

    @abc.abstractmethod
    def jumps(self, duration: float) -> tuple[float, ...]:
        """Times in (0, duration) at which the load is not smooth."""


class AbstractReference(eqx.Module):
    """What to follow."""

    @abc.abstractmethod
    def at(self, t: Time) -> Target:
        """Wanted position, velocity and acceleration at time t."""

    def starting_at(self, position: Outputs) -> "AbstractReference":
        """This reference for a plant that starts at a position; itself unless it leaves open where it begins."""
        return self


class AbstractNavigation(eqx.Module):
    """What stands between the truth and the measurement."""

    smooth: eqx.AbstractVar[bool]  # whether it has no memory and changes smoothly with the truth, as one ODE needs

    @abc.abstractmethod
    def realize(self, key: PRNGKeyArray) -> PyTree:
        """Path: everything random about one realisation."""

    @abc.abstractmethod
    def init(self, realization: PyTree, truth: Measurement) -> PyTree:
        """State at t = 0: what it remembers; () for nothing."""

    @abc.abstractmethod
    def measure(self, realization: PyTree, state: PyTree, t: Time, truth: Measurement) -> tuple[Measurement, PyTree]:
        """Measurement at time t, and the state after it."""

    def ignored(self, state: PyTree) -> Int[Array, ""]:
        """Readings so far that were no numbers, and that it has left out."""
        return jnp.zeros((), dtype=int)

    def velocity_noise(self, dt: float) -> Array:
        """What a law is told of it: standard deviation of white noise, new at every step of dt (s), on velocities.

        One number or one per output, m/s and rad/s; zero where nothing is known.
        """
        return as_array(0.0)
