"""Coordinates of laws that are the outputs of a plant themselves, Euler angles of a body included."""

from typing import Any

import equinox as eqx

from undertow.core.contracts import AbstractCoordinates, AbstractDynamics, Measurement, Outputs, Target, TrackingError
from undertow.core.status import Status


class AbstractOutputCoordinates(AbstractCoordinates):
    """The outputs and their rates."""

    def tracking_error(self, y: Measurement, r: Target) -> TrackingError:
        return TrackingError(self.difference(r.position, y.position), r.velocity - y.velocity, r.acceleration)

    def velocity(self, y: Measurement) -> Outputs:
        return y.velocity

    def with_velocity(self, y: Measurement, velocity: Outputs) -> Measurement:
        return self.measurement(y.position, velocity, y.actuator)

    def acceleration(self, y: Measurement, acceleration: Outputs) -> Outputs:
        return acceleration

    def output_velocity(self, y: Measurement, velocity: Outputs) -> Outputs:
        return velocity


class OutputCoordinates(AbstractOutputCoordinates):
    """Outputs of a plant that is not a body in space; there are no body axes."""

    angles: tuple[bool, ...] = eqx.field(static=True)
    tolerated_status: tuple[Status, ...] = eqx.field(static=True, default=())
    axes: tuple[str, ...] = eqx.field(static=True, default=())

    def measurement(self, position: Outputs, velocity: Outputs, actuator: Any = None) -> Measurement:
        return Measurement(position, velocity, actuator)

    def in_body_axes(self, dynamics: AbstractDynamics) -> None:
        return None
