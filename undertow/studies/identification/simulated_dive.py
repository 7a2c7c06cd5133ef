"""Logs of simulated dives, of a vehicle whose numbers are known: what an identification is tested with."""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.signal import lfilter

from undertow.core.numerics.rotations import euler_from_rotation, rotation_from_quaternion
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.studies.identification.identified_vehicle import AbstractActuation, IdentifiedVehicle, prior_vehicle
from undertow.studies.identification.prediction import Sensing, early_curve, late_curve, motion, on_cubic
from undertow.studies.identification.segments import Segments

_VOLTS = 2.3  # of a T200 at 1 N, about; thrust grows with the square
_FINE = 0.01  # s, of the integration
_BEFORE = 200  # steps of run-in
_JITTER = 0.2  # of the interval between two samples, at most


class SensorSpecification(NamedTuple):
    """How a sensor measures: rate in Hz, and standard deviation of its noise in the unit of the signal."""

    rate: float
    noise: float


# A vehicle with an acoustic position, an attitude reference, a DVL and gyros.
SENSORS = {
    "position": SensorSpecification(5.0, 0.02),
    "attitude": SensorSpecification(20.0, 0.01),
    "body_velocity": SensorSpecification(10.0, 0.02),
    "angular_velocity": SensorSpecification(50.0, 0.005),
}
_COLUMNS = {
    "position": (("north", "east", "down"), "m"),
    "attitude": (("roll", "pitch", "yaw"), "rad"),
    "body_velocity": (("surge", "sway", "heave"), "m/s"),
    "angular_velocity": (("p", "q", "r"), "rad/s"),
}


AMPLITUDES = np.array([25.0, 25.0, 25.0, 3.0, 3.0, 5.0])  # N, N m, of a BlueROV2 Heavy that moves lively


def telegraph_dive(
    plant: HybridVehicle, truth: Mapping[str, float], seed: int, duration: float = 60.0, **options: Any
) -> Log:
    """The log of a dive whose T200 thrusters jump at random.

    Args:
        plant: vehicle as its file has it.
        truth: parameters that differ from those of the plant, by name.
        seed: of everything random.
        duration: s.
        options: see `simulated_log`.
    """
    vehicle = prior_vehicle(plant).with_values({name: jnp.asarray(value) for name, value in truth.items()})
    return telegraph_log(plant, vehicle, np.random.default_rng(seed), duration, **options)


def telegraph_log(
    plant: HybridVehicle, vehicle: IdentifiedVehicle, generator: np.random.Generator, duration: float, **options: Any
) -> Log:
    """The same for a vehicle whose numbers are given as a whole.

    Args:
        plant: whose thrusters it has, at 16 V.
        vehicle: see there.
        generator: of everything random.
        duration: s.
        options: see `simulated_log`.
    """
    inverse = np.linalg.pinv(np.asarray(plant.thruster_matrix))
    thrust = telegraph_wrenches(generator, duration, AMPLITUDES) @ inverse.T
    volts = np.clip(_VOLTS * np.sign(thrust) * np.sqrt(np.abs(thrust)), -16, 16)
    return simulated_log(vehicle, volts, generator, **options)


def telegraph_wrenches(
    generator: np.random.Generator, duration: float, amplitudes: np.ndarray, shortest: float = 0.5, longest: float = 3.0
) -> np.ndarray:
    """Forces and moments that jump between minus, zero and plus an amplitude at random times, (steps, 6).

    Args:
        generator: of random numbers.
        duration: s.
        amplitudes: of the six axes, N and N m.
        shortest, longest: time between two jumps of an axis, s.
    """
    steps = round(duration / _FINE)
    wrenches = np.zeros((steps, 6))
    for axis, amplitude in enumerate(amplitudes):
        begin = 0
        while begin < steps:
            end = begin + max(1, round(generator.uniform(shortest, longest) / _FINE))
            wrenches[begin:end, axis] = amplitude * generator.choice([-1.0, 0.0, 1.0])
            begin = end
    return wrenches


def simulated_log(
    vehicle: IdentifiedVehicle,
    inputs: np.ndarray,
    generator: np.random.Generator,
    *,
    sensors: Mapping[str, SensorSpecification] = SENSORS,
    current: tuple[float, float, float] = (0.0, 0.0, 0.0),
    command_delay: float = 0.0,
    disturbance: np.ndarray | None = None,
    depth: float = 5.0,
    name: str = "simulated dive",
) -> Log:
    """The log of a dive that begins at rest.

    Args:
        vehicle: see there.
        inputs: of its thrusters every 0.01 s, of which every fifth is logged and acts, (steps, N).
        generator: of the noise and of the times of the samples.
        sensors: by signal.
        current: of the water, world, m/s.
        command_delay: s.
        disturbance: force and moment on the body that no log has, N and N m, (steps, 6); None for none.
        depth: at the begin, m.
        name: of the log.
    """
    held = np.repeat(inputs[::5], 5, axis=0)[: len(inputs)]
    if disturbance is not None:
        vehicle = dataclasses.replace(vehicle, actuation=_DisturbedActuation(vehicle.actuation))
        held = np.hstack([held, disturbance])
    truth = _motion(vehicle, jnp.asarray(command_delay), jnp.asarray(current), jnp.asarray(held), depth)
    curves = {name: _Curve(*map(np.asarray, curve)) for name, curve in truth.items()}
    duration = _FINE * len(inputs)
    time = _FINE * np.arange(len(inputs) + 1)
    signals = {}
    for signal, sensor in sensors.items():
        stamps = np.arange(0.0, duration, 1 / sensor.rate)
        stamps = stamps + generator.uniform(0.0, _JITTER / sensor.rate, len(stamps))
        values = curves[signal].at(stamps)
        if signal == "attitude":  # of quaternions between two steps
            values = np.asarray(_euler(jnp.asarray(values / np.linalg.norm(values, axis=1, keepdims=True))))
        values = values + sensor.noise * generator.standard_normal(values.shape)
        columns, unit = _COLUMNS[signal]
        signals[signal] = Series(stamps, values, columns, unit)
    numbers = tuple(f"T{i + 1}" for i in range(inputs.shape[1]))
    signals["input"] = Series(time[:-1:5], inputs[::5], numbers, "V")
    return Log(signals, name, "undertow")


def random_wrenches(
    generator: np.random.Generator, duration: float, deviations: np.ndarray, correlation_time: float
) -> np.ndarray:
    """Forces and moments on the body that vary at random, as a tether or eddies do: Gauss-Markov, (steps, 6).

    Args:
        generator: of random numbers.
        duration: s.
        deviations: standard deviations of the six axes, N and N m.
        correlation_time: s.
    """
    steps = round(duration / _FINE)
    kept = np.exp(-_FINE / correlation_time)
    pushes = np.sqrt(1 - kept**2) * generator.standard_normal((steps, 6))
    pushes[0] = generator.standard_normal(6)
    return deviations * lfilter([1.0], [1.0, -kept], pushes, axis=0)


class _DisturbedActuation(AbstractActuation):
    """Thrusters, and a force and moment that stand behind their inputs."""

    thrusters: AbstractActuation

    def initial_state(self):
        return self.thrusters.initial_state()

    def dynamics(self, state, u):
        return self.thrusters.dynamics(state, u[:-6])

    def wrench(self, state, u, nu):
        return self.thrusters.wrench(state, u[:-6], nu) + u[-6:]

    def solved(self, state, u, step):
        return self.thrusters.solved(state, u[:-6], step)

    def with_values(self, values):
        return _DisturbedActuation(self.thrusters.with_values(values))


class _Curve(NamedTuple):
    """A signal at every fine step, and its derivatives at begin and end of each: inputs jump between two steps."""

    values: np.ndarray  # (steps + 1, columns)
    rates_before: np.ndarray  # (steps, columns)
    rates_after: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """By the cubic through two values with both derivatives: straight lines would show a lag as longer."""
        steps = np.clip((times / _FINE).astype(int), 0, len(self.rates_before) - 1)
        share = (times / _FINE - steps)[:, None]
        begin, end = self.values[steps], self.values[steps + 1]
        early = early_curve(begin, end, _FINE * self.rates_before[steps])
        late = late_curve(begin, end, _FINE * self.rates_after[steps])
        return on_cubic(begin, end, early, late, share)


@eqx.filter_jit
def _motion(vehicle: IdentifiedVehicle, command_delay, current, inputs, depth: float):
    """True signals at every fine step, with their derivatives at begin and end of each: see `_Curve`."""
    steps = inputs.shape[0]
    start = jnp.zeros(13).at[2].set(depth).at[3].set(1.0)
    nothing = jnp.zeros((steps, 1))
    with_run_in = jnp.concatenate([jnp.zeros((_BEFORE, inputs.shape[1])), inputs])
    arrays = (with_run_in, nothing, nothing, nothing, nothing, start, jnp.zeros(()), jnp.zeros(()))
    segment = Segments(*arrays)  # pyright: ignore[reportArgumentType] - JAX arrays
    sensing = Sensing(command_delay, current, jnp.zeros(3))
    found = motion(vehicle, sensing, jnp.zeros(12), segment, jnp.asarray(_FINE))
    return {
        "position": tuple(x.position for x in found),
        "attitude": tuple(x.attitude for x in found),
        "body_velocity": tuple(x.nu[:, :3] for x in found),
        "angular_velocity": tuple(x.nu[:, 3:] for x in found),
    }


@jax.jit
def _euler(quaternions):
    """Roll, pitch, yaw of each."""
    return jax.vmap(lambda attitude: euler_from_rotation(rotation_from_quaternion(attitude)))(quaternions)
