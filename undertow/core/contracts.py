"""The contracts: pure functions on pytrees, SI units, t in s.

Objects hold parameters only; state goes in and comes out. A class is either abstract (never made) or final
(never inherited from).
"""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray, PyTree

from undertow.core.actuator_model import AbstractActuatorModel, Forces
from undertow.core.runtime import double_outside_runs
from undertow.core.signals import Signal
from undertow.core.status import Status
from undertow.numerics.linear_algebra import matvec

Time = Float[Array, ""]
Outputs = Float[Array, " n"]
Inputs = Float[Array, " m"]
Gain = Float[Array, "n m"]


class BodyMotion(NamedTuple):
    """Attitude and velocity of a body in forms that have no singularity."""

    attitude: Float[Array, "4"]  # unit quaternion, body -> world
    rotation: Float[Array, "3 3"]  # the same as a matrix
    nu: Float[Array, "6"]  # m/s, rad/s, body axes


class Measurement(NamedTuple):
    """What is measured of a plant: y; the state X of Eq. (18).

    The outputs of a body hold its attitude as Euler angles, a view for people and for the paper's law; `body` is the
    same pose and velocity without them. `undertow.core.measurement` makes both from either.
    """

    position: Outputs  # m, rad
    velocity: Outputs  # m/s, rad/s
    actuator: Any = None  # whatever else the actuators report; None when nothing
    body: BodyMotion | None = None  # None for a plant that is not a body in space


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


class AbstractDynamics(eqx.Module):
    """What a controller may know of how a plant moves: F and G of x_ddot = F + G f + d. Eq. (17).

    x_ddot stands for the rate of the velocity of the coordinates, and f for what the actuators give; where these are
    a `DirectActuator` of gain 1, f is the input u.
    """

    @abc.abstractmethod
    def drift(self, y: Measurement) -> Outputs:
        """F, m/s^2 and rad/s^2."""

    @abc.abstractmethod
    def gain(self, y: Measurement) -> Gain:
        """G, acceleration per force."""

    @abc.abstractmethod
    def invert(self, y: Measurement, acceleration: Outputs) -> Forces:
        """Smallest f with G f = acceleration as nearly as the plant allows: G# of Eqs. (22)-(27)."""


class TrackingError(NamedTuple):
    """How far a plant is from its target, in the coordinates of a law: E of Eq. (19), and what the target does."""

    error: Outputs  # e, m, rad
    rate: Outputs  # velocity of the target less that of the plant, m/s, rad/s
    acceleration: Outputs  # of the target, m/s^2, rad/s^2


class AbstractCoordinates(eqx.Module):
    """In what a law compares a plant with its target: the outputs themselves, or axes that turn with a body."""

    angles: eqx.AbstractVar[tuple[bool, ...]]  # which outputs are angles, to be compared modulo 2 pi
    tolerated_status: eqx.AbstractVar[tuple[Status, ...]]  # of the plant, under which a run goes on

    @abc.abstractmethod
    def measurement(self, position: Outputs, velocity: Outputs, actuator: Any = None) -> Measurement:
        """Measurement with given outputs and their rates."""

    @abc.abstractmethod
    def tracking_error(self, y: Measurement, r: Target) -> TrackingError:
        """Errors, the short way round where they are angles."""

    @abc.abstractmethod
    def velocity(self, y: Measurement) -> Outputs:
        """Velocity of the plant, m/s and rad/s."""

    @abc.abstractmethod
    def acceleration(self, y: Measurement, acceleration: Outputs) -> Outputs:
        """Rate of `velocity` for a second derivative of the outputs."""

    @abc.abstractmethod
    def output_velocity(self, y: Measurement, velocity: Outputs) -> Outputs:
        """Velocity of the outputs for one in these coordinates, or any small motion likewise."""

    @abc.abstractmethod
    def in_body_axes(self, dynamics: Any) -> "Model | None":
        """What is known as `dynamics` in body axes; None where there are no better coordinates than these."""

    def difference(self, target: Outputs, actual: Outputs) -> Outputs:
        """target - actual of outputs, angles the short way round."""
        turn = 2 * jnp.pi * jnp.asarray(self.angles, dtype=float)
        raw = target - actual
        return raw - turn * jnp.round(raw / (2 * jnp.pi))


class Model(NamedTuple):
    """What a controller is told of a plant: how it moves, in which coordinates, and what moves it."""

    dynamics: AbstractDynamics
    coordinates: AbstractCoordinates
    actuators: AbstractActuatorModel

    def in_body_axes(self) -> "Model":
        """The same knowledge in the coordinates that suit the plant best; itself where there are no better ones."""
        return self.coordinates.in_body_axes(self.dynamics) or self


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
    def model(self) -> Model:
        """What a controller is told of this plant; keyword arguments with defaults are the scenario's `model`."""

    @abc.abstractmethod
    def diagnostics(self, x: PyTree, u: Inputs) -> dict[str, Array]:
        """Values of the signals that this plant declares, by name."""

    @abc.abstractmethod
    def signals(self) -> dict[str, Signal]:
        """What is recorded of this plant alone, by name: each entry of `diagnostics`; {} for nothing."""

    def no_load(self) -> Load:
        """Load of load surroundings."""
        zero = jnp.zeros(len(self.outputs))
        return Load(zero, zero)


class AbstractController(eqx.Module):
    """A law. `command` before `advance`: the input leaves first, and adaptation sees what was applied."""

    model: eqx.AbstractVar[Model]

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

    @abc.abstractmethod
    def signals(self) -> dict[str, Signal]:
        """What `command` lets one look at, by name; {} for nothing."""


class AbstractInformedController(AbstractController):
    """A law that knows more of the acceleration than F + G u, such as what its motors do."""

    @abc.abstractmethod
    def known_acceleration(self, z: PyTree, y: Measurement, u_applied: Inputs) -> Outputs:
        """What the law takes for granted of the acceleration; d is all the rest."""


def known_acceleration(law: AbstractController, z: PyTree, y: Measurement, u_applied: Inputs) -> Outputs:
    """What a law takes for granted of the acceleration: F + G u, unless it says otherwise."""
    if isinstance(law, AbstractInformedController):
        return law.known_acceleration(z, y, u_applied)
    return law.model.dynamics.drift(y) + matvec(law.model.dynamics.gain(y), u_applied)


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


class AbstractOpenReference(AbstractReference):
    """A reference that leaves open where it begins."""

    @abc.abstractmethod
    def starting_at(self, position: Outputs) -> AbstractReference:
        """This reference for a plant that starts at a position."""


def starting_at(reference: AbstractReference, position: Outputs) -> AbstractReference:
    """A reference for a plant that starts at a position; itself unless it leaves open where it begins."""
    return reference.starting_at(position) if isinstance(reference, AbstractOpenReference) else reference


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


class AbstractInformedNavigation(AbstractNavigation):
    """A navigation filter that knows how noisy it is, and which readings it left out."""

    @abc.abstractmethod
    def velocity_noise(self, dt: float) -> Array:
        """What a law is told of it: standard deviation of white noise, new at every step of dt (s), on velocities.

        One number or one per output, m/s and rad/s; zero where nothing is known.
        """

    @abc.abstractmethod
    def ignored(self, state: PyTree) -> Int[Array, ""]:
        """Readings so far that were no numbers, and that it has left out."""
