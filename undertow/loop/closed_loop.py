"""The five roles around one loop, and what is written down about an instant."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray, PyTree

from undertow.core.arrays import as_array
from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractPlant,
    AbstractReference,
    AbstractSensor,
    Inputs,
    Load,
    Measurement,
    Outputs,
    Target,
    Telemetry,
    Time,
)


class Sample(NamedTuple):
    """Everything worth keeping of one instant; names as they stand in result files."""

    position: Outputs
    velocity: Outputs
    measured_position: Outputs  # what the controller was told
    measured_velocity: Outputs
    target: Outputs
    error: Outputs
    uncertainty: Outputs  # d = x_ddot - F - G V, measured, never assumed; holds Delta of Eq. (3) and all else
    estimate: Outputs
    robust: Outputs
    modelling_error: Outputs
    predicted_position: Outputs
    predicted_velocity: Outputs
    weights: Float[Array, "n rules"]  # theta
    weights_peak: Float[Array, ""]  # max |theta|
    voltage: Inputs  # applied
    command: Inputs  # asked for
    power: Inputs
    saturated: Inputs
    books: dict[str, Array]  # what this plant alone has to tell, by name


class Decision(NamedTuple):
    """What the controller makes of an instant."""

    y: Measurement
    r: Target
    command: Inputs
    applied: Inputs
    telemetry: Telemetry
    heard: PyTree  # state of the sensor afterwards


class ClosedLoop(eqx.Module):
    """Plant, controller, reference, disturbance and sensor, ready to be run by either loop."""

    plant: AbstractPlant
    controller: AbstractController
    reference: AbstractReference
    disturbance: AbstractDisturbance
    sensor: AbstractSensor

    def outputs_at_start(self, position: Any, velocity: Any) -> tuple[Outputs, Outputs]:
        """Outputs at t = 0 as arrays, zero where None: one compiled program serves every start."""
        zero = np.zeros(len(self.plant.outputs))
        made = lambda given: as_array(zero if given is None else given)
        return made(position), made(velocity)

    def draw(self, key: PRNGKeyArray) -> "Drawn":
        """Draw everything random once."""
        of_disturbance, of_sensor = jax.random.split(key)
        return Drawn(self, self.disturbance.draw(of_disturbance), self.sensor.draw(of_sensor))


class Drawn(NamedTuple):
    """A closed loop whose random parts have been drawn: from here on everything is a function of time."""

    loop: ClosedLoop
    disturbance_path: PyTree
    sensor_path: PyTree

    def start(self, position: Outputs | None = None, velocity: Outputs | None = None) -> tuple[PyTree, PyTree]:
        """States of plant and controller at t = 0, from the outputs there."""
        zero = jnp.zeros(())
        x = self.loop.plant.initial_state(position, velocity)
        truth = self.loop.plant.output(zero, x)
        y, _ = self.loop.sensor.measure(self.sensor_path, self.loop.sensor.init(self.sensor_path, truth), zero, truth)
        return x, self.loop.controller.init(y, self.loop.reference.at(zero))

    def listen(self, x: PyTree) -> PyTree:
        """State of the sensor at t = 0."""
        return self.loop.sensor.init(self.sensor_path, self.loop.plant.output(jnp.zeros(()), x))

    def load(self, t: Time, x: PyTree) -> Load:
        """What the surroundings do to the plant at time t."""
        plant = self.loop.plant
        return self.loop.disturbance.at(self.disturbance_path, t, plant.place(x), plant.no_load())

    def decide(self, t: Time, x: PyTree, z: PyTree, heard: PyTree = ()) -> Decision:
        """Measure, compare, command, limit; `heard` is the state of a sensor that has one."""
        truth = self.loop.plant.output(t, x)
        y, heard = self.loop.sensor.measure(self.sensor_path, heard, t, truth)
        r = self.loop.reference.at(t)
        command, telemetry = self.loop.controller.command(z, y, r)
        return Decision(y, r, command, self.loop.plant.admissible(x, command), telemetry, heard)

    def sample(self, t: Time, x: PyTree, z: PyTree, decision: Decision) -> Sample:
        """What is written down about time t. Errors are those of the truth, not of the measurement."""
        plant, controller = self.loop.plant, self.loop.controller
        truth = plant.output(t, x)
        y, r, command, applied, telemetry, _ = decision
        acceleration = plant.acceleration(t, x, applied, self.load(t, x))
        effort = plant.effort(x, applied)
        return Sample(
            position=truth.position,
            velocity=truth.velocity,
            measured_position=y.position,
            measured_velocity=y.velocity,
            target=r.position,
            error=controller.model.difference(r.position, truth.position),
            uncertainty=controller.model.seen(truth, acceleration) - controller.known(z, truth, applied),
            estimate=telemetry.estimate,
            robust=telemetry.robust,
            modelling_error=telemetry.modelling_error,
            predicted_position=telemetry.predicted_position,
            predicted_velocity=telemetry.predicted_velocity,
            weights=telemetry.weights,
            weights_peak=jnp.abs(telemetry.weights).max(initial=0.0),
            voltage=applied,
            command=command,
            power=effort.power,
            saturated=effort.saturated,
            books=plant.books(x, applied) | (telemetry.books or {}),
        )

    def look(self, t: Time, x: PyTree, z: PyTree, heard: PyTree = ()) -> Sample:
        """`sample` of the decision taken at time t."""
        return self.sample(t, x, z, self.decide(t, x, z, heard))
