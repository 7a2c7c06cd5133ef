"""Sensors and an observer with constant gains, which estimates x and x_dot at every control step."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.core.contracts import AbstractInformedNavigation, Measurement
from undertow.core.errors import BadInput
from undertow.navigation.drift import drift_advice
from undertow.numerics.random_keys import numbered
from undertow.sensors.estimate import Estimate, estimate_of, motion_of
from undertow.sensors.imu import IMU
from undertow.sensors.propeller_speed import PropellerSpeed
from undertow.sensors.sampling import SensorState
from undertow.sensors.sensor import AbstractSensor, AbstractVelocitySensor

# (m/s)^2 s; smaller densities count as no noise.
_NOISELESS = 1e-20


class NavigationState(NamedTuple):
    """State of the observer and its sensors."""

    time: Float[Array, ""]  # of the last step, s
    velocity: Float[Array, "3"]  # true velocity then, m/s; accelerometers measure its change
    sensors: tuple[SensorState, ...]  # state of each
    estimate: Estimate
    ignored: Int[Array, ""]  # readings so far that were not finite


class Navigation(AbstractInformedNavigation):
    """Strapdown inertial navigation, corrected by every other sensor with a constant gain.

    Between readings the estimate is integrated from rates and acceleration of the IMU. A delayed reading is compared
    with the estimate of the time at which it was taken. There is no Kalman filter and no estimate of a bias: an offset
    of the accelerometers, or of roll or pitch (times gravity), causes an error of the velocity: its growth between two
    readings of the DVL, divided by their `blend`. A reading that is not finite counts as lost.

    Raises:
        BadInput: no sensor, or no IMU.
    """

    sensors: tuple[AbstractSensor, ...]
    smooth: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        for i, sensor in enumerate(self.sensors):
            if not isinstance(sensor, AbstractSensor):
                raise BadInput(f"sensors[{i}]", "be a sensor", type(sensor).__name__)
        if not any(isinstance(sensor, IMU) for sensor in self.sensors):
            hint = "Add `imu`: no other sensor gives roll, pitch and angular rates"
            raise BadInput("sensors", "have an IMU among them", f"{len(self.sensors)} without", hint=hint)

    def realize(self, key):
        return jax.random.split(key, len(self.sensors))

    def velocity_noise(self, dt):
        """Noise density of all sensors, spread over every control step; the memory of the filters is neglected."""
        sensors = [one for one in self.sensors if isinstance(one, AbstractVelocitySensor)]
        densities = [one.velocity_noise() ** 2 * one.sampling.period for one in sensors]
        density = 1 / sum(1 / jnp.maximum(each, _NOISELESS) for each in densities)
        return jnp.where(jnp.isfinite(density) & (density > 2 * _NOISELESS), jnp.sqrt(density / dt), 0.0)

    def init(self, realization, truth: Measurement) -> NavigationState:
        if truth.position.shape != (6,):
            hint = "Take `perfect` or `white_noise`"
            raise BadInput("", "be used on a vehicle", f"a plant of {truth.position.shape[0]} outputs", hint=hint)
        motion = motion_of(truth, truth.velocity[:3], jnp.zeros(()))
        readings = [sensor.reading(motion) for sensor in self.sensors]
        chances = _chances(realization, jnp.full(len(readings), -1), readings)
        states = tuple(
            sensor.sampling.init(reading, chance[:-1])
            for sensor, reading, chance in zip(self.sensors, readings, chances, strict=True)
        )
        estimate = estimate_of(truth)
        if not any(isinstance(sensor, PropellerSpeed) for sensor in self.sensors):
            estimate = estimate._replace(actuator=None)
        return NavigationState(jnp.zeros(()), motion.velocity, states, estimate, jnp.zeros((), dtype=int))

    def measure(self, realization, state: NavigationState, t, truth: Measurement):
        elapsed = t - state.time
        motion = motion_of(truth, state.velocity, elapsed)
        readings = [sensor.reading(motion) for sensor in self.sensors]
        numbers = jnp.stack([sensor.sampling.number(t) for sensor in self.sensors])
        deliveries = [
            sensor.sampling.deliver(states, t, reading, chance)
            for sensor, states, reading, chance in zip(
                self.sensors, state.sensors, readings, _chances(realization, numbers, readings), strict=True
            )
        ]
        arrivals = [arrival for arrival, _ in deliveries]
        finite = [jnp.isfinite(reading).all() for reading, _ in arrivals]
        ignored = state.ignored + sum(
            jnp.where(fresh & ~good, 1, 0) for (_, fresh), good in zip(arrivals, finite, strict=True)
        )
        news = [
            (sensor, (reading, fresh & good))
            for sensor, (reading, fresh), good in zip(self.sensors, arrivals, finite, strict=True)
        ]
        estimate = state.estimate
        for sensor, (reading, fresh) in news:
            if isinstance(sensor, IMU):
                estimate = _either(fresh, sensor.predict(estimate, reading), estimate)
        estimate = estimate.predicted(elapsed)
        for sensor, (reading, fresh) in news:
            estimate = _either(fresh, sensor.correct(estimate, reading), estimate)
        states = tuple(states for _, states in deliveries)
        return estimate.measurement(), NavigationState(t, motion.velocity, states, estimate, ignored)

    def advice(self, duration: float = 60.0) -> tuple[str, ...]:
        """What is not measured, and how far its estimate drifts in `duration` (s)."""
        return drift_advice(self.sensors, duration)

    def ignored(self, state: NavigationState):
        return state.ignored


def _chances(keys, numbers, readings) -> list:
    """Standard normal numbers, one per entry of each reading and one more, in one call, which compiles faster."""
    most = max(reading.size for reading in readings) + 1
    normal = lambda key, number: jax.random.normal(numbered(key, number), (most,), dtype=readings[0].dtype)
    together = jax.vmap(normal)(keys, numbers)
    return [row[: reading.size + 1] for row, reading in zip(together, readings, strict=True)]


def _either(fresh, new: Estimate, old: Estimate) -> Estimate:
    return jax.tree.map(lambda a, b: jnp.where(fresh, a, b), new, old)


def observer(sensors) -> Navigation:
    """Navigation of a vehicle from its sensors only. For the sampled loop.

    Args:
        sensors: any of imu, dvl, depth, position_fix, compass, propeller_speed; an IMU must be among them.
    """
    return Navigation(sensors=tuple(sensors))
