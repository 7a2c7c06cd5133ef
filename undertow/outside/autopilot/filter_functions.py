"""The functions of a navigation filter that is stepped: its start, and a step with the readings that have arrived."""

from typing import Any, NamedTuple

import jax.numpy as jnp

from undertow.control.navigation.from_sensors import AbstractFilter, sensor_names
from undertow.core.arrays import in_present_precision
from undertow.core.contracts import AbstractPlant
from undertow.core.measurement import measurement_of_pose
from undertow.physics.sensors.motion import motion_of
from undertow.physics.sensors.received import Received


class EstimatedMotion(NamedTuple):
    """Estimated motion; `autopilot.step(*motion)` takes it, if it was made with `attitude="quaternion"`.

    Attributes:
        position: north, east, down, m.
        velocity: u, v, w, p, q, r in body axes, m/s and rad/s.
        attitude: quaternion w, x, y, z, body -> world.
    """

    position: Any  # an array of 3, 6 and 4 numbers
    velocity: Any
    attitude: Any


class FilterAnswer(NamedTuple):
    """What a step gives: the estimated motion, what propellers report, and the signals of the filter."""

    motion: EstimatedMotion
    actuator: Any
    signals: dict[str, Any]


class FilterFunctions:
    """Functions of the filter and arrays that JAX can trace, and examples of their arguments in the present precision.

    Args:
        navigation: the filter.
        plant: whose actuators report what they do.

    Attributes:
        sensors: numbers of a reading, by name of the sensor: `imu`, `dvl`, ...; a second DVL is `dvl_2`.
        delays: s that readings take, in the order of the sensors; below likewise.
        at_rest: readings of a vehicle at rest and level.
        nothing: no reading of any sensor.
        pose: a motion at rest.
    """

    def __init__(self, navigation: AbstractFilter, plant: AbstractPlant):
        self.filter = in_present_precision(navigation)
        self._report = plant.output(jnp.zeros(()), plant.initial_state()).actuator
        self.pose = EstimatedMotion(jnp.zeros(3), jnp.zeros(6), jnp.array([1.0, 0, 0, 0]))
        motion_at_rest = motion_of(self._measurement(self.pose), jnp.zeros(3), jnp.zeros(()))
        self.at_rest = [sensor.reading(motion_at_rest) for sensor in self.filter.sensors]
        self.sensors = {
            name: reading.size for name, reading in zip(sensor_names(self.filter.sensors), self.at_rest, strict=True)
        }
        self.delays = [float(sensor.sampling.delay) for sensor in self.filter.sensors]
        self.nothing = tuple(Received(0 * reading, jnp.asarray(False), jnp.zeros(())) for reading in self.at_rest)

    def first(self, navigation: AbstractFilter, pose: EstimatedMotion) -> Any:
        """State for a motion that is known."""
        return navigation.start(self._measurement(pose))

    def following(self, navigation: AbstractFilter, state: Any, elapsed: Any, received: tuple[Received, ...]):
        """State and answer `elapsed` (s) later, with what the sensors delivered since."""
        state = navigation.update(state, elapsed, received)
        y = navigation.measurement(state)
        assert y.body is not None
        motion = EstimatedMotion(y.position[:3], y.body.nu, y.body.attitude)
        return state, FilterAnswer(motion, y.actuator, navigation.diagnostics(state))

    def _measurement(self, pose: EstimatedMotion):
        return measurement_of_pose(pose.position, pose.attitude, pose.velocity, self._report)
