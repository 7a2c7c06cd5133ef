"""Models of several subsystems side by side: the nominal model of a plant that consists of several, block by block.

No subsystem enters the model of another: what couples them is part of the uncertainty d.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import AbstractCoordinates, AbstractDynamics, Measurement, Model, Target, TrackingError
from undertow.core.status import Status

Parts = tuple[Model, ...]


def composite_model(parts: Parts, inputs: tuple[int, ...]) -> Model:
    """The model of subsystems side by side; outputs and inputs in their order.

    Args:
        parts: model of each.
        inputs: number of inputs of each.
    """
    dynamics = CompositeDynamics(parts, inputs)
    actuators = CompositeActuators(tuple(part.actuators for part in parts), inputs)
    return Model(dynamics, _side_by_side(tuple(part.coordinates for part in parts)), actuators)


def parts_of(model: Model) -> tuple[Parts, tuple[int, ...]]:
    """Models of the subsystems of a model, and their numbers of inputs; the model itself where it is of one."""
    if isinstance(model.dynamics, CompositeDynamics):
        return model.dynamics.parts, model.dynamics.inputs
    zeros = jnp.zeros(len(model.coordinates.angles))
    return (model,), (model.dynamics.gain(model.coordinates.measurement(zeros, zeros)).shape[1],)


def split(values: Float[Array, " k"], sizes: tuple[int, ...]) -> tuple[Array, ...]:
    """The entries of each subsystem."""
    ends = [sum(sizes[: i + 1]) for i in range(len(sizes))]
    return tuple(values[end - size : end] for end, size in zip(ends, sizes, strict=True))


def split_measurement(coordinates: tuple[AbstractCoordinates, ...], y: Measurement) -> tuple[Measurement, ...]:
    """Measurement of each subsystem: its own outputs, and the report of its own actuators."""
    if len(coordinates) == 1:
        return (y,)
    sizes = tuple(len(part.angles) for part in coordinates)
    reports = (None,) * len(sizes) if y.actuator is None else y.actuator
    subsystems = zip(coordinates, split(y.position, sizes), split(y.velocity, sizes), reports, strict=True)
    return tuple(part.measurement(position, velocity, report) for part, position, velocity, report in subsystems)


def split_target(coordinates: tuple[AbstractCoordinates, ...], r: Target) -> tuple[Target, ...]:
    """Reference of each subsystem."""
    sizes = tuple(len(part.angles) for part in coordinates)
    rows_of_parts = [split(row, sizes) for row in r]
    return tuple(Target(*rows) for rows in zip(*rows_of_parts, strict=True))


class CompositeCoordinates(AbstractCoordinates):
    """The coordinates of each subsystem."""

    parts: tuple[AbstractCoordinates, ...]
    angles: tuple[bool, ...] = eqx.field(static=True)
    tolerated_status: tuple[Status, ...] = eqx.field(static=True)
    axes: tuple[str, ...] = eqx.field(static=True)

    def measurement(self, position, velocity, actuator: Any = None) -> Measurement:
        return Measurement(position, velocity, actuator)

    def tracking_error(self, y: Measurement, r: Target) -> TrackingError:
        subsystems = zip(self.parts, split_measurement(self.parts, y), split_target(self.parts, r), strict=True)
        errors = [part.tracking_error(measurement, target) for part, measurement, target in subsystems]
        return TrackingError(*(jnp.concatenate(rows) for rows in zip(*errors, strict=True)))

    def velocity(self, y: Measurement):
        subsystems = zip(self.parts, split_measurement(self.parts, y), strict=True)
        return jnp.concatenate([part.velocity(measurement) for part, measurement in subsystems])

    def with_velocity(self, y: Measurement, velocity):
        subsystems = zip(self.parts, split_measurement(self.parts, y), self._split(velocity), strict=True)
        rates = [
            part.with_velocity(measurement, part_velocity).velocity for part, measurement, part_velocity in subsystems
        ]
        return y._replace(velocity=jnp.concatenate(rates))

    def acceleration(self, y: Measurement, acceleration):
        subsystems = zip(self.parts, split_measurement(self.parts, y), self._split(acceleration), strict=True)
        return jnp.concatenate(
            [part.acceleration(measurement, part_acceleration) for part, measurement, part_acceleration in subsystems]
        )

    def output_velocity(self, y: Measurement, velocity):
        subsystems = zip(self.parts, split_measurement(self.parts, y), self._split(velocity), strict=True)
        return jnp.concatenate(
            [part.output_velocity(measurement, part_velocity) for part, measurement, part_velocity in subsystems]
        )

    def in_body_axes(self, dynamics: "CompositeDynamics") -> Model | None:
        """Every subsystem in its body axes; None where none has any."""
        parts = tuple(part.in_body_axes() for part in dynamics.parts)
        unchanged = all(new is old for new, old in zip(parts, dynamics.parts, strict=True))
        return None if unchanged else composite_model(parts, dynamics.inputs)

    def _split(self, values) -> tuple[Array, ...]:
        return split(values, tuple(len(part.angles) for part in self.parts))


def _side_by_side(parts: tuple[AbstractCoordinates, ...]) -> CompositeCoordinates:
    """Coordinates of all; names of axes have the number of the subsystem, and there are none where one has none."""
    first, *other_flags = (part.tolerated_status for part in parts)
    axis_names = [f"{name}_{i + 1}" for i, part in enumerate(parts) for name in part.axes]
    return CompositeCoordinates(
        parts=parts,
        angles=tuple(angle for part in parts for angle in part.angles),
        tolerated_status=tuple(flag for flag in first if all(flag in flags for flags in other_flags)),
        axes=tuple(axis_names) if all(part.axes for part in parts) else (),
    )


class CompositeDynamics(AbstractDynamics):
    """F and G of each subsystem: G has a block for each."""

    parts: Parts
    inputs: tuple[int, ...] = eqx.field(static=True)

    def drift(self, y: Measurement):
        return jnp.concatenate([part.dynamics.drift(measurement) for part, measurement in self._each(y)])

    def gain(self, y: Measurement):
        rows, before = [], 0
        for (part, measurement), count in zip(self._each(y), self.inputs, strict=True):
            block = part.dynamics.gain(measurement)
            after = sum(self.inputs) - before - count
            rows.append(jnp.pad(block, ((0, 0), (before, after))))
            before += count
        return jnp.concatenate(rows)

    def invert(self, y: Measurement, acceleration):
        sizes = tuple(len(part.coordinates.angles) for part in self.parts)
        subsystems = zip(self._each(y), split(acceleration, sizes), strict=True)
        return jnp.concatenate(
            [part.dynamics.invert(measurement, demanded) for (part, measurement), demanded in subsystems]
        )

    def _each(self, y: Measurement) -> list[tuple[Model, Measurement]]:
        coordinates = tuple(part.coordinates for part in self.parts)
        return list(zip(self.parts, split_measurement(coordinates, y), strict=True))


class CompositeActuators(AbstractActuatorModel):
    """The actuators of each subsystem; state and report are those of each, in a tuple."""

    parts: tuple[AbstractActuatorModel, ...]
    inputs: tuple[int, ...] = eqx.field(static=True)

    def max_bandwidth(self, sampled):
        return jnp.stack([part.max_bandwidth(sampled) for part in self.parts]).min()

    def time_constant(self):
        """That of the slowest; None where one is unknown."""
        time_constants = [part.time_constant() for part in self.parts]
        maxima = [jnp.max(time_constant) for time_constant in time_constants if time_constant is not None]
        return jnp.stack(maxima).max() if len(maxima) == len(time_constants) else None

    def init(self) -> tuple[Any, ...]:
        return tuple(part.init() for part in self.parts)

    def update_from_report(self, state, report) -> tuple[Any, ...]:
        reports = (None,) * len(self.parts) if report is None else report
        subsystems = zip(self.parts, state, reports, strict=True)
        return tuple(part.update_from_report(part_state, part_report) for part, part_state, part_report in subsystems)

    def range(self, state, rate):
        ranges = [part.range(part_state, rate) for part, part_state in zip(self.parts, state, strict=True)]
        return self._joined([low for low, _ in ranges]), self._joined([high for _, high in ranges])

    def force(self, state, u):
        return self._joined(
            [part.force(part_state, part_input) for part, part_state, part_input in self._each(state, u)]
        )

    def command(self, state, force, rate):
        return self._joined(
            [part.command(part_state, part_force, rate) for part, part_state, part_force in self._each(state, force)]
        )

    def target_of(self, state, u, rate):
        return self._joined(
            [part.target_of(part_state, part_input, rate) for part, part_state, part_input in self._each(state, u)]
        )

    def advance(self, state, u, dt) -> tuple[Any, ...]:
        return tuple(part.advance(part_state, part_input, dt) for part, part_state, part_input in self._each(state, u))

    def dead_zone(self):
        """That of the subsystem with the largest."""
        return jnp.stack([part.dead_zone() for part in self.parts]).max()

    def quasi_static(self) -> "CompositeActuators":
        return CompositeActuators(tuple(part.quasi_static() for part in self.parts), self.inputs)

    def _each(self, state, values):
        return list(zip(self.parts, state, split(values, self.inputs), strict=True))

    def _joined(self, values) -> Array:
        """One entry per actuator, of values that hold for each or for one."""
        values_and_counts = zip(values, self.inputs, strict=True)
        return jnp.concatenate([jnp.broadcast_to(jnp.asarray(value), (count,)) for value, count in values_and_counts])
