"""Drift of the observer's estimate where no sensor measures an output itself, only its rate.

The errors are those of white noise and constant offsets that are integrated: a rate once, an acceleration twice.
Inclination errors count as accelerations: gravity times the angle. With a sensor of velocity, an error of the
acceleration acts for period / dvl_blend only. What else there is adds to it, so that the drift is at least this large.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jax.typing import ArrayLike

from undertow.physics.sensors.imu import IMU
from undertow.physics.sensors.motion import gravity
from undertow.physics.sensors.sensor import AbstractSensor, AbstractVelocitySensor

_REMEDIES = {"north and east": "position_fix", "down": "depth", "yaw": "compass"}


class _Error(NamedTuple):
    """An error that is integrated: density of its white part (unit^2 s), and its offset (unit)."""

    density: float
    offset: float


def drift_advice(sensors: Sequence[AbstractSensor], dvl_blend: ArrayLike, duration: float) -> tuple[str, ...]:
    """A sentence where an output drifts in `duration` (s), with the sensors that prevent it."""
    drift_of = drifts(sensors, dvl_blend, duration)
    if not drift_of:
        return ()
    in_unit = lambda output, size: f"{np.degrees(size):.2g} degrees" if output == "yaw" else f"{size:.2g} m"
    sizes = {output: in_unit(output, size) for output, size in drift_of.items()}
    drift_text = " and ".join(f"{size} ({output})" for output, size in sizes.items())
    remedies = " and ".join(f"`{_REMEDIES[output]}`" for output in drift_of)
    unbiased = not any(np.any(np.asarray(sensor.sampling.bias)) for sensor in sensors)
    noise_only = " by noise alone, to which the biases of real sensors add" if unbiased else ""
    return (
        f"no sensor measures {', '.join(drift_of)}: the estimate drifts by about {drift_text} in {duration:g} s, "
        f"one standard deviation{noise_only}. Add {remedies} to `navigation.sensors`",
    )


def drifts(sensors: Sequence[AbstractSensor], dvl_blend: ArrayLike, duration: float) -> dict[str, float]:
    """Standard deviation of the error (m, rad) after `duration` (s) of what no sensor measures.

    Empty where a sensor does not say what it measures, or without an IMU.
    """
    imu = next((sensor for sensor in sensors if isinstance(sensor, IMU)), None)
    if imu is None or any(sensor.fixes is None for sensor in sensors):
        return {}
    fixed = {output for sensor in sensors for output in sensor.fixes or ()}
    noise = np.broadcast_to(np.asarray(imu.sampling.noise, dtype=float), 8)
    bias = np.broadcast_to(np.asarray(imu.sampling.bias, dtype=float), 8)
    g, period = float(np.asarray(gravity())[2]), float(imu.sampling.period)
    error = lambda index, of_gravity: _Error(
        period * (noise[index] ** 2 + (of_gravity * noise[0]) ** 2), float(np.hypot(bias[index], of_gravity * bias[0]))
    )
    drift_of = {}
    if not {"north", "east"} <= fixed:
        drift_of["north and east"] = _of_position(sensors, dvl_blend, error(5, g), 0, duration)
    if "down" not in fixed:
        drift_of["down"] = _of_position(sensors, dvl_blend, error(7, 0.0), 2, duration)
    if "yaw" not in fixed:
        drift_of["yaw"] = _once(error(4, 0.0), duration)
    return {output_name: float(drift) for output_name, drift in drift_of.items() if drift > 0}


def _of_position(
    sensors: Sequence[AbstractSensor], dvl_blend: ArrayLike, acceleration: _Error, axis: int, duration: float
) -> float:
    """With the first sensor of velocity, or from the acceleration alone."""
    for sensor in sensors:
        if isinstance(sensor, AbstractVelocitySensor) and np.isfinite(noise := float(sensor.velocity_noise()[axis])):
            held = float(np.asarray(sensor.sampling.period) / np.asarray(dvl_blend))
            offset = float(np.ravel(np.broadcast_to(np.asarray(sensor.sampling.bias, dtype=float), 3))[axis])
            density = float(sensor.sampling.period) * noise**2 + acceleration.density * held**2
            return _once(_Error(density, float(np.hypot(offset, acceleration.offset * held))), duration)
    return float(np.sqrt(acceleration.density * duration**3 / 3 + (acceleration.offset * duration**2 / 2) ** 2))


def _once(rate: _Error, duration: float) -> float:
    return float(np.sqrt(rate.density * duration + (rate.offset * duration) ** 2))
