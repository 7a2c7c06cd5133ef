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
from undertow.core.numerics.integrators import METHODS
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.runtime import double_outside_runs, says_single
from undertow.core.signals import Signal
from undertow.core.status import Status

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
    """Measured outputs y of a plant: the state X of Eq. (18).

    The outputs of a body hold its attitude as Euler angles, as people and the paper's law use it; `body` holds the
    same pose and velocity without them. `undertow.core.measurement` converts each into the other.
    """

    position: Outputs  # m, rad
    velocity: Outputs  # m/s, rad/s
    actuator: Any = None  # report of the actuators; None where there is none
    body: BodyMotion | None = None  # None for a plant that is not a body in space
    # Per actuator, 1, or 0 where it announced that it has failed; None where none announces anything.
    health: Any = None


class Target(NamedTuple):
    """Reference r of a plant: desired position, velocity and acceleration."""

    position: Outputs
    velocity: Outputs
    acceleration: Outputs


class Pose(NamedTuple):
    """Position, attitude and velocity of a body, for loads that depend on them. World axes north, east, down."""

    position: Float[Array, "3"]  # m
    rotation: Float[Array, "3 3"]  # body -> world
    velocity: Float[Array, "3"]  # m/s


class Water(NamedTuple):
    """Undisturbed motion of the water at the position of the body. World axes."""

    velocity: Float[Array, "3"]  # m/s
    acceleration: Float[Array, "3"]  # m/s^2


class FreeSurface(NamedTuple):
    """The surface of the water above the position of the body."""

    depth: Float[Array, ""]  # of the world's origin below the surface at rest, m
    elevation: Float[Array, ""]  # of the surface above that, m


class ModelScaling(NamedTuple):
    """Factors of the true body relative to the nominal model; 1 for no mismatch."""

    mass: Float[Array, ""]  # on M, and with it on C
    damping: Float[Array, ""]  # on D
    restoring: Float[Array, ""]  # on g
    thrust: Float[Array, ""]  # on the thrust of every thruster


class Payload(NamedTuple):
    """A point mass that the body carries."""

    mass: Float[Array, ""]  # kg
    weight: Float[Array, ""]  # N, in water
    point: Float[Array, "3"]  # m, body axes


class Load(NamedTuple):
    """Effect of the environment on a plant. Loads add; None and () stand for no load and cost no computation."""

    acceleration: Outputs  # lumped, added to x_ddot; m/s^2, rad/s^2
    wrench: Outputs  # w_d of Eq. (2), on the left side: it opposes; N, N m (body axes for a vehicle)
    water: Water | None = None
    scaling: ModelScaling | None = None
    payloads: tuple[Payload, ...] = ()
    surface: FreeSurface | None = None  # None where the water has no end


class Effort(NamedTuple):
    """Cost of driving the actuators."""

    power: Inputs  # electrical power, W
    saturated: Inputs  # 1 where an input is at its limit, else 0


class AbstractDynamics(eqx.Module):
    """Nominal dynamics of a plant: F and G of x_ddot = F + G f + d. Eq. (17).

    x_ddot is the rate of the velocity in the coordinates, and f the force of the actuators; where these are
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
        """Smallest f that gives the acceleration, or the nearest to it: G# of Eqs. (22)-(27)."""


class AbstractNonAffineDynamics(AbstractDynamics):
    """Nominal dynamics x_ddot = F + g(x, u) + d whose g is not linear in the input.

    `gain` and `invert` are those of an affine model of the same plant, for laws and analyses that need one.
    """

    @abc.abstractmethod
    def forced(self, y: Measurement, u: Inputs) -> Outputs:
        """g, the acceleration that an input gives, m/s^2 and rad/s^2."""

    @abc.abstractmethod
    def solve(self, y: Measurement, acceleration: Outputs) -> Inputs:
        """Input with g(x, u) = acceleration, or the nearest to it."""


def forced_acceleration(dynamics: AbstractDynamics, y: Measurement, u: Inputs) -> Outputs:
    """Acceleration that an input gives by the nominal dynamics: G u, or g(x, u)."""
    if isinstance(dynamics, AbstractNonAffineDynamics):
        return dynamics.forced(y, u)
    return matvec(dynamics.gain(y), u)


def input_for(dynamics: AbstractDynamics, y: Measurement, acceleration: Outputs) -> Inputs:
    """Input that gives an acceleration by the nominal dynamics: G# of it, or the solution of g(x, u) = acceleration."""
    if isinstance(dynamics, AbstractNonAffineDynamics):
        return dynamics.solve(y, acceleration)
    return dynamics.invert(y, acceleration)


class TrackingError(NamedTuple):
    """Tracking error in the coordinates of a law, E of Eq. (19), and the acceleration of the target."""

    error: Outputs  # e, m, rad
    rate: Outputs  # velocity of the target less that of the plant, m/s, rad/s
    acceleration: Outputs  # of the target, m/s^2, rad/s^2


class AbstractCoordinates(eqx.Module):
    """Coordinates in which a law computes the tracking error: the outputs themselves, or body axes."""

    angles: eqx.AbstractVar[tuple[bool, ...]]  # which outputs are angles, compared modulo 2 pi
    tolerated_status: eqx.AbstractVar[tuple[Status, ...]]  # of the plant, with which a run continues
    axes: eqx.AbstractVar[tuple[str, ...]]  # names of the axes of errors and velocity; () where they are the outputs

    @abc.abstractmethod
    def measurement(self, position: Outputs, velocity: Outputs, actuator: Any = None) -> Measurement:
        """Measurement with given outputs and their rates."""

    @abc.abstractmethod
    def tracking_error(self, y: Measurement, r: Target) -> TrackingError:
        """Tracking errors; those of angles in [-pi, pi)."""

    @abc.abstractmethod
    def velocity(self, y: Measurement) -> Outputs:
        """Velocity of the plant, m/s and rad/s."""

    @abc.abstractmethod
    def with_velocity(self, y: Measurement, velocity: Outputs) -> Measurement:
        """The same pose and report of the actuators, with another `velocity`."""

    @abc.abstractmethod
    def acceleration(self, y: Measurement, acceleration: Outputs) -> Outputs:
        """Rate of `velocity` that belongs to a second derivative of the outputs."""

    @abc.abstractmethod
    def output_velocity(self, y: Measurement, velocity: Outputs) -> Outputs:
        """Velocity of the outputs that belongs to a velocity, or any small motion, in these coordinates."""

    @abc.abstractmethod
    def in_body_axes(self, dynamics: Any) -> "Model | None":
        """Model with `dynamics` expressed in body axes; None for a plant that has none."""

    def difference(self, target: Outputs, actual: Outputs) -> Outputs:
        """target - actual of outputs; differences of angles in [-pi, pi)."""
        turn = 2 * jnp.pi * jnp.asarray(self.angles, dtype=float)
        raw = target - actual
        return raw - turn * jnp.round(raw / (2 * jnp.pi))


class Model(NamedTuple):
    """Nominal model of a plant, as the controller uses it: dynamics, coordinates and actuators."""

    dynamics: AbstractDynamics
    coordinates: AbstractCoordinates
    actuators: AbstractActuatorModel

    def drift_at_target_velocity(self, y: Measurement, rate: Outputs) -> Outputs:
        """F at the measured pose and the velocity of the target: what a law compensates, m/s^2 and rad/s^2.

        At the measured velocity, the compensation of a drag that the vehicle does not have would be positive feedback
        of its velocity; this way the drag of the vehicle damps, whatever it is.

        Args:
            y: measurement.
            rate: velocity of the target less that of the plant, m/s, rad/s.
        """
        target = self.coordinates.velocity(y) + rate
        return self.dynamics.drift(self.coordinates.with_velocity(y, target))

    def in_body_axes(self) -> "Model":
        """The same model in body axes; itself where the plant has none."""
        return self.coordinates.in_body_axes(self.dynamics) or self


class AbstractPlant(eqx.Module):
    """A second-order control-affine system with n outputs and m inputs, Eq. (20)."""

    outputs: eqx.AbstractVar[tuple[str, ...]]  # names of the n outputs
    output_units: eqx.AbstractVar[tuple[str, ...]]
    input_unit: eqx.AbstractVar[str]

    def __init_subclass__(cls, **options: Any):
        super().__init_subclass__(**options)
        if "model" in vars(cls):  # its numbers are made before any run, as those of the plant are
            cls.model = double_outside_runs(cls.model)

    @abc.abstractmethod
    def initial_state(self, position: Outputs | None = None, velocity: Outputs | None = None) -> PyTree:
        """State x with given outputs (zero where None), actuators at rest."""

    @abc.abstractmethod
    def dynamics(self, t: Time, x: PyTree, u: Inputs, d: Load) -> PyTree:
        """dx/dt."""

    @abc.abstractmethod
    def output(self, t: Time, x: PyTree) -> Measurement:
        """y without measurement error."""

    @abc.abstractmethod
    def acceleration(self, t: Time, x: PyTree, u: Inputs, d: Load) -> Outputs:
        """x_ddot of the outputs, m/s^2 and rad/s^2."""

    @abc.abstractmethod
    def pose(self, x: PyTree) -> Pose | None:
        """Pose of the body; None for plants that are not bodies in water."""

    @abc.abstractmethod
    def admissible(self, x: PyTree, u: Inputs) -> Inputs:
        """Input that is applied when u is commanded in state x (limits)."""

    @abc.abstractmethod
    def effort(self, x: PyTree, u: Inputs) -> Effort:
        """Cost of applying u."""

    @abc.abstractmethod
    def inputs(self) -> int:
        """Number m of inputs."""

    @abc.abstractmethod
    def status(self, x: PyTree) -> Array:
        """Status code of a state; `Status.OK` while the state is valid."""

    @abc.abstractmethod
    def advice(self) -> tuple[str, ...]:
        """Advice before this plant is run, each sentence with the numbers that caused it."""

    @abc.abstractmethod
    def model(self) -> Model:
        """Nominal model for the controller; keyword arguments with defaults are the scenario's `model`."""

    @abc.abstractmethod
    def diagnostics(self, x: PyTree, u: Inputs) -> dict[str, Array]:
        """Values of the signals that this plant declares, by name."""

    @abc.abstractmethod
    def signals(self) -> dict[str, Signal]:
        """Declarations of the signals of `diagnostics`, by name; {} for none."""

    def no_load(self) -> Load:
        """Load where the environment does not act."""
        zero = jnp.zeros(len(self.outputs))
        return Load(zero, zero)


class AbstractController(eqx.Module):
    """A control law. `command` comes before `advance`, so that adaptation uses the input that was applied.

    What only some laws can do has a default: `known_acceleration`, `takes_raw_readings`, `knowledge` and `restarted`.
    """

    model: eqx.AbstractVar[Model]

    def __init_subclass__(cls, **options: Any):
        super().__init_subclass__(**options)
        if "init" in vars(cls):
            cls.init = says_single(cls.init)

    @abc.abstractmethod
    def init(self, y: Measurement, r: Target) -> PyTree:
        """State z before the first measurement is used."""

    @abc.abstractmethod
    def command(self, z: PyTree, y: Measurement, r: Target) -> tuple[Inputs, dict[str, Array]]:
        """Input u, and the values of the declared signals by name, which are recorded only.

        A signal `estimate` is the law's estimate of d; it is used where a reading is not finite.
        """

    @abc.abstractmethod
    def advance(self, z: PyTree, y: Measurement, r: Target, u_applied: Inputs, dt: Time) -> PyTree:
        """State one sampling time later."""

    @abc.abstractmethod
    def signals(self) -> dict[str, Signal]:
        """Declarations of the signals of `command`, by name; {} for none."""

    def known_acceleration(self, z: PyTree, y: Measurement, u_applied: Inputs) -> Outputs:
        """The acceleration that the law models; d is the rest. F + G u, or F + g(x, u), unless it models more."""
        dynamics = self.model.dynamics
        return dynamics.drift(y) + forced_acceleration(dynamics, y, u_applied)

    @property
    def takes_raw_readings(self) -> bool:
        """Whether it decides by itself what to do with readings that are not finite: it gets them as they are."""
        return False

    def knowledge(self, z: PyTree) -> PyTree:
        """What of a state a restart must not lose, such as which thrusters have failed; () for nothing."""
        return ()

    def restarted(self, knowledge: PyTree, y: Measurement, r: Target) -> PyTree:
        """State of a law that begins again from a measurement, with what was known."""
        return self.init(y, r)


class AbstractContinuousController(AbstractController):
    """A law given by `command` and dz/dt = `flow`, as in the paper's equations.

    The continuous loop integrates `flow` together with the plant as one ODE. The sampled loop holds y, r and u
    over one sampling time and takes `substeps` steps of `method`.
    """

    method: eqx.AbstractVar[str]  # of undertow.core.numerics.integrators
    substeps: eqx.AbstractVar[int]

    @abc.abstractmethod
    def flow(self, z: PyTree, y: Measurement, r: Target, u_applied: Inputs) -> PyTree:
        """dz/dt."""

    @abc.abstractmethod
    def project(self, z: PyTree) -> PyTree:
        """z projected onto its admissible set after a finite step; z itself where it has no bounds."""

    def advance(self, z: PyTree, y: Measurement, r: Target, u_applied: Inputs, dt: Time) -> PyTree:
        """State one sampling time later, with y, r and u held."""
        step = METHODS[self.method]
        start = jnp.zeros(())
        for _ in range(self.substeps):
            z = step(lambda _, z: self.flow(z, y, r, u_applied), start, z, dt / self.substeps)
            z = self.project(z)
        return z


class AbstractDisturbance(eqx.Module):
    """A load that is sampled once from a key and is a function of time afterwards."""

    @abc.abstractmethod
    def realize(self, key: PRNGKeyArray) -> PyTree:
        """Realization: everything random about one run."""

    @abc.abstractmethod
    def at(self, realization: PyTree, t: Time, pose: Pose | None, load: Load) -> Load:
        """The load with this disturbance added to `load`, that of the others, at time t."""

    @abc.abstractmethod
    def jumps(self, duration: float) -> tuple[float, ...]:
        """Times in (0, duration), s, at which the load is not smooth."""


class AbstractFaults(eqx.Module):
    """Faults of sensors, actuators and plant, injected into a run. Each method does nothing before the first onset."""

    @abc.abstractmethod
    def realize(self, key: PRNGKeyArray) -> PyTree:
        """Realization: everything random about one run."""

    @abc.abstractmethod
    def init(self, realization: PyTree, y: Measurement, u: Inputs) -> PyTree:
        """State before the first step, for a measurement and an input of these shapes."""

    @abc.abstractmethod
    def measurement(self, realization: PyTree, state: PyTree, t: Time, y: Measurement) -> tuple[Measurement, PyTree]:
        """Measurement that reaches the controller at time t, and the state afterwards."""

    @abc.abstractmethod
    def input(
        self, realization: PyTree, state: PyTree, t: Time, u: Inputs, limits: tuple[Inputs, Inputs]
    ) -> tuple[Inputs, PyTree]:
        """Input that acts on the plant although `u` is applied, as far as the controller knows; and the state.

        `limits` are the least and the largest input that the plant takes now.
        """

    @abc.abstractmethod
    def load(self, realization: PyTree, t: Time, pose: Pose | None, load: Load) -> Load:
        """The load with that of faults of the plant added to it."""

    @abc.abstractmethod
    def active(self, realization: PyTree, t: Time) -> Int[Array, ""]:
        """Number of faults that are present at time t."""

    @abc.abstractmethod
    def jumps(self, duration: float) -> tuple[float, ...]:
        """Times in (0, duration), s, at which faults begin and end."""

    def sampled(self, realization: PyTree) -> dict[int, dict[str, Array]]:
        """What may be random in a run, by place of the fault in the scenario and name; {} unless a part says so."""
        return {}


class AbstractReference(eqx.Module):
    """Desired motion as a function of time."""

    @abc.abstractmethod
    def at(self, t: Time) -> Target:
        """Desired position, velocity and acceleration at time t."""


class AbstractOpenReference(AbstractReference):
    """A reference whose start is not given."""

    @abc.abstractmethod
    def starting_at(self, position: Outputs) -> AbstractReference:
        """This reference for a plant that starts at a position."""


def starting_at(reference: AbstractReference, position: Outputs) -> AbstractReference:
    """A reference for a plant that starts at a position; itself unless its start is not given."""
    return reference.starting_at(position) if isinstance(reference, AbstractOpenReference) else reference


class AbstractNavigation(eqx.Module):
    """Navigation filter: it makes the measurement from the true state."""

    smooth: eqx.AbstractVar[bool]  # no memory, and smooth in the true state, as one ODE needs

    @abc.abstractmethod
    def realize(self, key: PRNGKeyArray) -> PyTree:
        """Realization: everything random about one run."""

    @abc.abstractmethod
    def init(self, realization: PyTree, truth: Measurement) -> PyTree:
        """State at t = 0; () for a filter without memory."""

    @abc.abstractmethod
    def measure(self, realization: PyTree, state: PyTree, t: Time, truth: Measurement) -> tuple[Measurement, PyTree]:
        """Measurement at time t and the state after it."""

    def simulated_sensors(self) -> tuple[Any, ...]:
        """Sensors whose readings it simulates and filters; () where it reads the true motion."""
        return ()


class AbstractInformedNavigation(AbstractNavigation):
    """A navigation filter that reports its noise and the readings that it ignored."""

    @abc.abstractmethod
    def velocity_noise(self, dt: float) -> Array:
        """Nominal standard deviation of white noise on the velocities, new at every step of dt (s).

        One number or one per output, m/s and rad/s; zero where it is unknown.
        """

    @abc.abstractmethod
    def ignored(self, state: PyTree) -> Int[Array, ""]:
        """Number of readings so far that were ignored because they were not finite."""

    @abc.abstractmethod
    def signals(self) -> dict[str, Signal]:
        """Declarations of the signals of `diagnostics`, by name; {} for none."""

    @abc.abstractmethod
    def diagnostics(self, state: PyTree) -> dict[str, Array]:
        """Values of the signals that this filter declares, by name."""
