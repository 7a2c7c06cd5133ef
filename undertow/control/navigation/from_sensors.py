"""Navigation of a vehicle from its sensors, whose readings are simulated; a filter estimates the motion from them."""

import abc
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PyTree

from undertow.control.navigation.consistency import normalised_square
from undertow.core.contracts import AbstractInformedNavigation, Measurement
from undertow.core.errors import BadInput
from undertow.core.numerics.number import Number
from undertow.core.numerics.random_keys import numbered
from undertow.core.signals import Signal
from undertow.physics.sensors.gauss_markov import Disturbed
from undertow.physics.sensors.imu import IMU
from undertow.physics.sensors.motion import motion_of
from undertow.physics.sensors.received import AbstractSensorFaults, Received
from undertow.physics.sensors.sampling import SensorState
from undertow.physics.sensors.sensor import (
    AbstractDisturbedSensor,
    AbstractSensor,
    AbstractVelocitySensor,
    error_slopes,
)

# (m/s)^2 s; smaller densities count as no noise.
_NOISELESS = 1e-20


class AbstractFilter(eqx.Module):
    """A filter that estimates the motion of a vehicle from readings, as they come.

    In a simulation and on a vehicle it is the same; only the readings come from elsewhere.
    """

    sensors: eqx.AbstractVar[tuple[AbstractSensor, ...]]

    @abc.abstractmethod
    def start(self, y: Measurement) -> PyTree:
        """State for a motion that is known."""

    @abc.abstractmethod
    def update(self, state: PyTree, elapsed: Number, received: tuple[Received, ...]) -> PyTree:
        """State `elapsed` (s) later, with what the sensors delivered since; entries that are not finite are lost."""

    @abc.abstractmethod
    def measurement(self, state: PyTree) -> Measurement:
        """The estimate, for a controller."""

    @abc.abstractmethod
    def signals(self) -> dict[str, Signal]:
        """Declarations of the signals of `diagnostics`, by name; {} for none."""

    @abc.abstractmethod
    def diagnostics(self, state: PyTree) -> dict[str, Array]:
        """Values of the signals that this filter declares, by name."""

    @abc.abstractmethod
    def advice(self, duration: float) -> tuple[str, ...]:
        """What the sensors do not measure, and how far its estimate drifts in `duration` (s)."""


class AbstractCovarianceFilter(AbstractFilter):
    """A filter that says how large the errors of its estimate are."""

    @abc.abstractmethod
    def errors(self, state: PyTree, truth: Measurement) -> Float[Array, " errors"]:
        """True errors of the estimated attitude, velocity and position, each an axis or more, of units of its own."""

    @abc.abstractmethod
    def error_covariance(self, state: PyTree) -> Float[Array, "errors errors"]:
        """Covariance of these errors by the account of the filter."""


class SensorNavigationState(NamedTuple):
    """State of the sensors and of the filter."""

    time: Float[Array, ""]  # of the last step, s
    velocity: Float[Array, "3"]  # true velocity then, m/s; accelerometers measure its change
    sensors: tuple[SensorState, ...]  # state of each
    filter: Any
    ignored: Int[Array, ""]  # readings so far that were not finite
    faults: Any = ()  # state of the faults of the sensors; () without any
    errors: Any = ()  # of the estimate, of a filter that says how large they are; () of others


class SensorNavigation(AbstractInformedNavigation):
    """Readings of the sensors of a filter, simulated with errors and delays, and what the filter makes of them."""

    filter: AbstractFilter
    smooth: bool = eqx.field(static=True, default=False)
    faults: AbstractSensorFaults | None = None

    def realize(self, key):
        """A key for each sensor, then one for their faults and one for their correlated errors, where there are any."""
        count = len(self.filter.sensors)
        disturbed = any(count_errors(sensor) for sensor in self.filter.sensors)
        return jax.random.split(key, count + (self.faults is not None) + disturbed)

    def simulated_sensors(self):
        return self.filter.sensors

    def velocity_noise(self, dt):
        """Noise density of all sensors, spread over every control step; the memory of the filters is neglected."""
        sensors = [sensor for sensor in self.filter.sensors if isinstance(sensor, AbstractVelocitySensor)]
        densities = [sensor.velocity_noise() ** 2 * sensor.sampling.period for sensor in sensors]
        density = 1 / sum(1 / jnp.maximum(sensor_density, _NOISELESS) for sensor_density in densities)
        return jnp.where(jnp.isfinite(density) & (density > 2 * _NOISELESS), jnp.sqrt(density / dt), 0.0)

    def init(self, realization, truth: Measurement) -> SensorNavigationState:
        if truth.position.shape != (6,):
            hint = "Take `perfect` or `white_noise`"
            raise BadInput("", "be used on a vehicle", f"a plant of {truth.position.shape[0]} outputs", hint=hint)
        motion = motion_of(truth, truth.velocity[:3], jnp.zeros(()))
        readings = [sensor.reading(motion) for sensor in self.filter.sensors]
        for sensor in self.filter.sensors:
            if isinstance(sensor, AbstractDisturbedSensor):
                sensor.check(motion)
        before_the_first = jnp.full(len(readings), -1)
        chances = _chances(realization[: len(readings)], before_the_first, readings)
        of_errors = _error_chances(realization[-1], before_the_first, self.filter.sensors, motion.position.dtype)
        states = tuple(
            sensor.sampling.init(reading, chance[:-1], error_chance)
            for sensor, reading, chance, error_chance in zip(
                self.filter.sensors, readings, chances, of_errors, strict=True
            )
        )
        start = self.filter.start(truth)
        faults = () if self.faults is None else self.faults.init(readings)
        ignored, errors = jnp.zeros((), dtype=int), self._errors(start, truth)
        return SensorNavigationState(jnp.zeros(()), motion.velocity, states, start, ignored, faults, errors)

    def measure(self, realization, state: SensorNavigationState, t, truth: Measurement):
        received, states, velocity = self.sample(realization, state, t, truth)
        faults = state.faults
        if self.faults is not None:
            received, faults = self.faults.received(realization[len(received)], faults, t, received)
        unusable = [delivery.fresh & ~jnp.isfinite(delivery.reading).all() for delivery in received]
        estimated = self.filter.update(state.filter, t - state.time, received)
        ignored = state.ignored + sum(jnp.where(flag, 1, 0) for flag in unusable)
        after = SensorNavigationState(t, velocity, states, estimated, ignored, faults, self._errors(estimated, truth))
        return self.filter.measurement(estimated), after

    def sample(self, realization, state: SensorNavigationState, t, truth: Measurement):
        """What the sensors deliver at time t, their states afterwards, and the true velocity (m/s)."""
        motion = motion_of(truth, state.velocity, t - state.time)
        readings = [sensor.reading(motion) for sensor in self.filter.sensors]
        numbers = jnp.stack([sensor.sampling.number(t) for sensor in self.filter.sensors])
        chances = _chances(realization[: len(readings)], numbers, readings)
        of_errors = _error_chances(realization[-1], numbers, self.filter.sensors, motion.position.dtype)
        disturbed = [
            None if chance is None else Disturbed(error_slopes(sensor, motion), chance)
            for sensor, chance in zip(self.filter.sensors, of_errors, strict=True)
        ]
        deliveries = [
            sensor.sampling.deliver(states, t, reading, chance, errors)
            for sensor, states, reading, chance, errors in zip(
                self.filter.sensors, state.sensors, readings, chances, disturbed, strict=True
            )
        ]
        received = tuple(
            Received(*delivery, age=sensor.sampling.delay)
            for sensor, (delivery, _) in zip(self.filter.sensors, deliveries, strict=True)
        )
        return received, tuple(states for _, states in deliveries), motion.velocity

    def signals(self):
        signals = self.filter.signals()
        if isinstance(self.filter, AbstractCovarianceFilter):
            meaning = "normalised estimation error squared of position, velocity and attitude; 9 is as the filter says"
            signals = signals | {"nees": Signal((), "1", meaning)}
        return signals

    def diagnostics(self, state: SensorNavigationState):
        values = self.filter.diagnostics(state.filter)
        if isinstance(self.filter, AbstractCovarianceFilter):
            values = values | {"nees": normalised_square(state.errors, self.filter.error_covariance(state.filter))}
        return values

    def _errors(self, estimated: PyTree, truth: Measurement) -> Any:
        return self.filter.errors(estimated, truth) if isinstance(self.filter, AbstractCovarianceFilter) else ()

    def advice(self, duration: float = 60.0) -> tuple[str, ...]:
        """What the sensors do not measure, and how far its estimate drifts in `duration` (s)."""
        return self.filter.advice(duration)

    def ignored(self, state: SensorNavigationState):
        return state.ignored


def count_errors(sensor: AbstractSensor) -> int:
    """Number of the correlated errors of a sensor."""
    errors = sensor.sampling.errors
    return 0 if errors is None else len(errors.deviation)


def sensor_names(sensors: Sequence[AbstractSensor]) -> list[str]:
    """A name for each sensor: that of its class in lower case, with a number from the second on."""
    names: list[str] = []
    for sensor in sensors:
        plain = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(sensor).__name__).lower()
        same = sum(name == plain or name.startswith(f"{plain}_") for name in names)
        names.append(f"{plain}_{same + 1}" if same else plain)
    return names


def check_sensors(sensors: Sequence[AbstractSensor]) -> None:
    """Check what a filter is given.

    Raises:
        BadInput: something else than a sensor, or no IMU.
    """
    for i, sensor in enumerate(sensors):
        if not isinstance(sensor, AbstractSensor):
            raise BadInput(f"sensors[{i}]", "be a sensor", type(sensor).__name__)
    if not any(isinstance(sensor, IMU) for sensor in sensors):
        hint = "Add `imu`: no other sensor gives roll, pitch and angular rates"
        raise BadInput("sensors", "have an IMU among them", f"{len(sensors)} without", hint=hint)


def _chances(keys, numbers, readings) -> list:
    """Standard normal numbers, one per entry of each reading and one more, in one call, which compiles faster."""
    width = max(reading.size for reading in readings) + 1
    normal = lambda key, number: jax.random.normal(numbered(key, number), (width,), dtype=readings[0].dtype)
    rows = jax.vmap(normal)(keys, numbers)
    return [row[: reading.size + 1] for row, reading in zip(rows, readings, strict=True)]


def _error_chances(key, numbers, sensors: Sequence[AbstractSensor], dtype) -> list[Array | None]:
    """Standard normal numbers for the correlated errors of each sensor; None for one that has none."""
    counts = [count_errors(sensor) for sensor in sensors]
    if not any(counts):
        return [None] * len(sensors)
    normal = lambda key, number: jax.random.normal(numbered(key, number), (max(counts),), dtype=dtype)
    rows = jax.vmap(normal)(jax.random.split(key, len(sensors)), numbers)
    return [row[:count] if count else None for row, count in zip(rows, counts, strict=True)]
