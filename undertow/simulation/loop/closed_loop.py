"""The closed loop of plant, controller, reference, disturbance and navigation, and its signals at an instant."""

import dataclasses
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int, PRNGKeyArray, PyTree

from undertow.core.arrays import as_array
from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractFaults,
    AbstractInformedNavigation,
    AbstractNavigation,
    AbstractPlant,
    AbstractReference,
    Inputs,
    Load,
    Measurement,
    Outputs,
    Pose,
    Target,
    Time,
    starting_at,
)
from undertow.core.errors import BadInput
from undertow.core.expected_measurement import Expected, at_start
from undertow.core.measurement import with_pose
from undertow.core.numerics.random_keys import keys_for
from undertow.core.return_checks import check_command
from undertow.core.signals import Signal, check_declared
from undertow.simulation.loop.recorded_signals import RECORDED, RECORDED_WITH_FAULTS, Signals

# Input beyond the limit of any actuator, in its unit: what the plant makes of it is its limit.
_LARGE = 1e6


class MeasurementState(NamedTuple):
    """State of measuring, and of faults."""

    navigation: PyTree  # its state
    expected: Expected | None  # None for smooth navigation, whose readings are finite where the truth is
    faults: PyTree = ()  # () without faults


class Decision(NamedTuple):
    """Measurement, target and input of the controller at an instant."""

    y: Measurement
    r: Target
    command: Inputs
    applied: Inputs  # as far as the controller knows
    signals: Signals  # that the controller declares
    measuring: Any  # MeasurementState afterwards; () where there is none
    acting: Inputs  # on the plant: other than the applied one where an actuator has failed


class ClosedLoop(eqx.Module):
    """Plant, controller, reference, disturbance, navigation and faults, ready to be run by either loop.

    Faults are decided at every control step, which only the sampled loop has.
    """

    plant: AbstractPlant
    controller: AbstractController
    reference: AbstractReference
    disturbance: AbstractDisturbance
    navigation: AbstractNavigation
    faults: AbstractFaults | None = None

    def outputs_at_start(self, position: Any, velocity: Any) -> tuple[Outputs, Outputs]:
        """Outputs at t = 0 as arrays, zero where None: one compiled program serves every start."""
        zero = np.zeros(len(self.plant.outputs))
        as_outputs = lambda value: as_array(zero if value is None else value)
        return as_outputs(position), as_outputs(velocity)

    def starting_at(self, position: Any) -> "ClosedLoop":
        """This loop with its reference beginning where the plant does; at zero where None."""
        start, _ = self.outputs_at_start(position, None)
        reference = starting_at(self.reference, start)
        return dataclasses.replace(self, reference=reference)

    def signals(self) -> dict[str, Signal]:
        """Declarations of everything that is recorded of this loop, by name.

        Raises:
            BadInput: two parts declare a signal of the same name.
        """
        declarations = RECORDED | (RECORDED_WITH_FAULTS if self.faults is not None else {})
        informed = [self.navigation] if isinstance(self.navigation, AbstractInformedNavigation) else []
        for part in (self.plant, self.controller, *informed):
            for name, signal in part.signals().items():
                if name in declarations:
                    raise BadInput(name, "be the name of one signal only", f"declared again by {type(part).__name__}")
                declarations[name] = signal
        return declarations

    def realize(self, key: PRNGKeyArray) -> "Realization":
        """Sample everything random once."""
        return self.realized_with(self.disturbance.realize(_keys(key)["disturbance"]), key)

    def realized_with(self, disturbance: PyTree, key: PRNGKeyArray) -> "Realization":
        """The same with a realization of the disturbance that is known."""
        keys = _keys(key)
        faults = () if self.faults is None else self.faults.realize(keys["faults"])
        return Realization(self, disturbance, self.navigation.realize(keys["navigation"]), faults)


class Realization(NamedTuple):
    """A closed loop whose random parts have been sampled: everything else is a function of time."""

    loop: ClosedLoop
    disturbance_realization: PyTree
    navigation_realization: PyTree
    faults_realization: PyTree = ()

    def start(self, position: Outputs | None = None, velocity: Outputs | None = None) -> tuple[PyTree, PyTree]:
        """States of plant and controller at t = 0, from the outputs there."""
        x, y = self.measured_at_start(position, velocity)
        return x, self.loop.controller.init(y, self.loop.reference.at(jnp.zeros(())))

    def measured_at_start(
        self, position: Outputs | None = None, velocity: Outputs | None = None
    ) -> tuple[PyTree, Measurement]:
        """State of the plant at t = 0, from the outputs there, and its measurement."""
        zero = jnp.zeros(())
        x = self.loop.plant.initial_state(position, velocity)
        y, _ = self.read(zero, self.loop.plant.output(zero, x), self.initial_measuring(x))
        return x, y

    def initial_measuring(self, x: PyTree) -> MeasurementState:
        """State of measuring at t = 0."""
        zero, navigation = jnp.zeros(()), self.loop.navigation
        truth = self.loop.plant.output(zero, x)
        state, faults = navigation.init(self.navigation_realization, truth), self._faults_at_start(truth)
        # Where the field is not static it is traced, and treated as False.
        if navigation.smooth is True and self.loop.faults is None:
            return MeasurementState(state, None)
        y, _ = _measured(navigation, self.navigation_realization, state, zero, truth)
        return MeasurementState(state, at_start(self.loop.controller.model.coordinates, truth, y), faults)

    def _faults_at_start(self, truth: Measurement) -> PyTree:
        if self.loop.faults is None:
            return ()
        return self.loop.faults.init(self.faults_realization, truth, jnp.zeros(self.loop.plant.inputs()))

    def load(self, t: Time, x: PyTree) -> Load:
        """Load of the environment on the plant at time t."""
        return self.load_at(t, self.loop.plant.pose(x))

    def load_at(self, t: Time, pose: Pose | None) -> Load:
        """Load of the environment at a pose: that of the disturbance and of the faults."""
        plant, faults = self.loop.plant, self.loop.faults
        load = self.loop.disturbance.at(self.disturbance_realization, t, pose, plant.no_load())
        return load if faults is None else faults.load(self.faults_realization, t, pose, load)

    def motion(self, t: Time, x: PyTree, acting: Inputs) -> PyTree:
        """Rates of the plant's state, of the shape of that."""
        return _moved(self, t, x, acting)

    def decide(self, t: Time, x: PyTree, z: PyTree, measuring: Any = ()) -> Decision:
        """Measure, compute the command and limit it; `measuring` is that of the previous step."""
        return _decided(self, t, x, z, measuring)

    def read(self, t: Time, truth: Measurement, measuring: Any) -> tuple[Measurement, Any]:
        """Measurement for the law, and the state of measuring afterwards."""

        loop, realization = self.loop, self.navigation_realization
        if not isinstance(measuring, MeasurementState):
            return _completed(_measured(loop.navigation, realization, measuring, t, truth), truth)
        y, state = _completed(_measured(loop.navigation, realization, measuring.navigation, t, truth), truth)
        faults = measuring.faults
        if loop.faults is not None:
            y, faults = loop.faults.measurement(self.faults_realization, faults, t, y)
        if measuring.expected is None:
            return y, MeasurementState(state, None, faults)
        repaired, expected = measuring.expected.repaired(loop.controller.model.coordinates, y)
        received = y if loop.controller.takes_raw_readings else repaired
        return received, MeasurementState(state, expected, faults)

    def failed(self, faults: PyTree, t: Time, x: PyTree, applied: Inputs) -> tuple[Inputs, PyTree]:
        """Input that acts on the plant, and the state of the faults, of a loop with faults."""
        return _failed(self, faults, t, x, applied)

    def signals(self, t: Time, x: PyTree, z: PyTree, decision: Decision) -> Signals:
        """All recorded signals of time t. Errors are those of the true state, not of the measurement."""
        plant, controller = self.loop.plant, self.loop.controller
        truth = plant.output(t, x)
        y, r, command, applied, of_controller, measuring, acting = decision
        acceleration = plant.acceleration(t, x, acting, self.load(t, x))
        effort = plant.effort(x, acting)
        of_plant = plant.diagnostics(x, acting)
        check_declared(plant, of_plant, "diagnostics")
        check_declared(controller, of_controller, "command")
        recorded = {
            "position": truth.position,
            "velocity": truth.velocity,
            "measured_position": y.position,
            "measured_velocity": y.velocity,
            "reference": r.position,
            "error": controller.model.coordinates.difference(r.position, truth.position),
            # From the true acceleration; it includes Delta of Eq. (3).
            "uncertainty": controller.model.coordinates.acceleration(truth, acceleration)
            - controller.known_acceleration(z, truth, applied),
            "input": applied,
            "commanded_input": command,
            "power": effort.power,
            "saturated": effort.saturated,
            "bad_readings": self._bad_readings(measuring),
        }
        if self.loop.faults is not None:
            recorded |= {"acting_input": acting, "active_faults": self.loop.faults.active(self.faults_realization, t)}
        return recorded | of_plant | of_controller | self._of_navigation(measuring)

    def _of_navigation(self, measuring: Any) -> Signals:
        """Signals that the navigation declares."""
        navigation = self.loop.navigation
        if not (isinstance(measuring, MeasurementState) and isinstance(navigation, AbstractInformedNavigation)):
            return {}
        diagnostics = navigation.diagnostics(measuring.navigation)
        check_declared(navigation, diagnostics, "diagnostics")
        return diagnostics

    def _bad_readings(self, measuring: Any) -> Int[Array, ""]:
        """Number of readings so far that were not finite: ignored by the navigation, or replaced for the law."""
        if not isinstance(measuring, MeasurementState) or measuring.expected is None:
            return jnp.zeros((), dtype=int)
        navigation, replaced = self.loop.navigation, measuring.expected.replaced
        if not isinstance(navigation, AbstractInformedNavigation):
            return replaced
        return replaced + navigation.ignored(measuring.navigation)

    def record(self, t: Time, x: PyTree, z: PyTree, measuring: Any = ()) -> Signals:
        """Signals of the decision taken at time t."""
        return self.signals(t, x, z, self.decide(t, x, z, measuring))


# Start, every stage of a step, and records call these alike: JAX traces each once.
@eqx.filter_jit
def _decided(realization: Realization, t: Time, x: PyTree, z: PyTree, measuring: Any) -> Decision:
    loop = realization.loop
    y, measuring = realization.read(t, loop.plant.output(t, x), measuring)
    r = loop.reference.at(t)
    answer = loop.controller.command(z, y, r)
    check_command(loop.controller, answer, loop.plant.inputs())
    command, signals = answer
    applied = acting = loop.plant.admissible(x, command)
    if loop.faults is not None and isinstance(measuring, MeasurementState):
        acting, faults = _failed(realization, measuring.faults, t, x, applied)
        measuring = measuring._replace(faults=faults)
    return Decision(y, r, command, applied, signals, measuring, acting)


def _failed(realization: Realization, faults: PyTree, t: Time, x: PyTree, applied: Inputs) -> tuple[Inputs, PyTree]:
    """Input that acts on the plant, and the state of the faults."""
    loop = realization.loop
    most = jnp.full(applied.shape, _LARGE)
    limits = loop.plant.admissible(x, -most), loop.plant.admissible(x, most)
    assert loop.faults is not None
    return loop.faults.input(realization.faults_realization, faults, t, applied, limits)


@eqx.filter_jit
def _measured(navigation: AbstractNavigation, realization: PyTree, state: PyTree, t: Time, truth: Measurement):
    return navigation.measure(realization, state, t, truth)


@eqx.filter_jit
def _moved(realization: Realization, t: Time, x: PyTree, applied: Inputs) -> PyTree:
    return realization.loop.plant.dynamics(t, x, applied, realization.load(t, x))


def _completed(measured: tuple[Measurement, PyTree], truth: Measurement) -> tuple[Measurement, PyTree]:
    return with_pose(measured[0], truth), measured[1]


def _keys(key: PRNGKeyArray) -> dict[str, PRNGKeyArray]:
    return keys_for(key, "disturbance", "navigation", "faults")
