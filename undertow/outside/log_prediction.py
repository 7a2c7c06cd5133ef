"""The motion that the model of a vehicle predicts over windows of a log, driven by the logged thruster commands.

Each window starts from the logged pose and velocity. Rotors are run in before, with the commands of the two seconds
before the start.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import Inputs, Outputs
from undertow.core.measurement import body_of
from undertow.core.numerics.integrators import METHODS
from undertow.core.numerics.random_keys import key_of_seed
from undertow.core.runtime import on_processor
from undertow.logs.log_signals import Series
from undertow.logs.motion import LoggedMotion
from undertow.physics.plants.hybrid_vehicle import HybridVehicle, VehicleState
from undertow.scenario.build import Built
from undertow.scenario.scenario_vehicle import vehicle_of
from undertow.simulation.loop.closed_loop import Realization

RUN_IN = 2.0  # s; rotors forget within tenths of a second
_EARLY = 1e-2  # share of the median interval by which a command counts early, as in controllers/replay.py


class PredictedMotion(NamedTuple):
    """Motion at some times after each start.

    Attributes:
        motion: north, east, down (m), roll, pitch, yaw (rad), surge, sway, heave (m/s), p, q, r (rad/s), shape
            (variants, starts, times, 12).
        after: times after the start, s.
    """

    motion: np.ndarray
    after: np.ndarray


class _Windows(NamedTuple):
    """What the starts differ in; each with a leading axis over them."""

    time: Any  # of each step, s
    inputs: Any  # held over each step
    before: VehicleState  # where the rotors are run in
    start: VehicleState


def predict(
    built: Built,
    motion: LoggedMotion,
    inputs: Series,
    starts: np.ndarray,
    steps: int,
    stride: int,
    limited: bool,
    factors: np.ndarray,
) -> PredictedMotion:
    """The motion that the model of a scenario's vehicle predicts from starts in a log, in its disturbance.

    Args:
        built: the scenario.
        motion: of the log.
        inputs: of its thrusters.
        starts: times, s.
        steps: of control after each start.
        stride: steps between the times of the prediction.
        limited: whether the inputs are commands, which the vehicle limits, rather than what was applied.
        factors: on the input of each thruster, a row per variant.
    """
    plant = vehicle_of(built)
    loop = built.scenario.loop
    before = round(RUN_IN / loop.dt)
    times = starts[:, None] + loop.dt * np.arange(-before, steps)
    with on_processor():
        realization = built.closed_loop.realize(key_of_seed(built.scenario.seed))
        windows = _Windows(
            time=jnp.asarray(times - motion.time[0]),
            inputs=jnp.asarray(held(inputs, times)),
            before=_states(plant, motion, times[:, 0]),
            start=_states(plant, motion, starts),
        )
        settings = (before, stride, loop.method if loop.method in METHODS else "rk4", loop.substeps)
        dt = jnp.asarray(loop.dt, dtype=float)
        predicted = jax.device_get(_predicted(realization, windows, jnp.asarray(factors), dt, limited, settings))
    return PredictedMotion(np.asarray(predicted), loop.dt * stride * np.arange(1, steps // stride + 1))


def starts_of(motion: LoggedMotion, inputs: Series, longest: float, every: float) -> np.ndarray:
    """Times at which a model may start: samples of the motion, with commands before and a motion to compare after.

    Args:
        motion: of the log.
        inputs: of its thrusters.
        longest: time after the start that is compared, s.
        every: s between starts.
    """
    first, last = _span(motion, inputs, longest)
    tolerance = 1e-9 * max(1.0, abs(last))
    if first > last + tolerance:
        return np.zeros(0)
    times = np.arange(first, last + tolerance, every)
    samples = np.searchsorted(motion.time, times - tolerance).clip(0, len(motion.time) - 1)
    starts = np.unique(motion.time[samples])
    return starts[starts <= last + tolerance]


def _span(motion: LoggedMotion, inputs: Series, longest: float) -> tuple[float, float]:
    """First and last time at which a model may start, s."""
    first = max(motion.time[0], inputs.time[0]) + RUN_IN
    return first, min(motion.time[-1], inputs.time[-1]) - longest


def time_together(motion: LoggedMotion, inputs: Series) -> float:
    """Time for which a log has both motion and inputs, s."""
    first, last = _span(motion, inputs, 0.0)
    return last - first + RUN_IN


def held(inputs: Series, times: np.ndarray) -> np.ndarray:
    """Inputs at times: those of the last sample until then."""
    tolerance = _EARLY * np.median(np.diff(inputs.time))
    indices = np.searchsorted(inputs.time, times + tolerance, side="right") - 1
    return inputs.values[indices.clip(0, len(inputs.time) - 1)]


def logged(motion: LoggedMotion, times: np.ndarray) -> np.ndarray:
    """Outputs and body velocity of the log at times, linear between samples."""
    rows = np.hstack([motion.outputs, motion.nu])
    return np.stack([np.interp(times, motion.time, column) for column in rows.T], axis=-1)


def _states(plant: HybridVehicle, motion: LoggedMotion, times: np.ndarray) -> VehicleState:
    """States of the vehicle at times of the log, rotors at rest."""
    rows = jnp.asarray(logged(motion, times))

    def state(row: Outputs) -> VehicleState:
        return plant.initial_state(row[:6])._replace(nu=row[6:])

    return jax.jit(jax.vmap(state))(rows)


@eqx.filter_jit
def _predicted(
    realization: Realization, windows: _Windows, factors, dt, limited: bool, settings: tuple[int, int, str, int]
):
    """Outputs and body velocity after every stride of each window, with each row of factors on the inputs."""
    before, stride, method, substeps = settings
    plant = realization.loop.plant
    integrate = METHODS[method]

    def step(x: VehicleState, time_and_input: tuple[Any, Inputs]):
        t, u = time_and_input
        u = plant.admissible(x, u) if limited else u
        h = dt / substeps
        for i in range(substeps):
            x = integrate(lambda t, x: realization.motion(jnp.asarray(t), x, u), t + i * h, x, h)
        return x, None

    def stride_of_steps(x: VehicleState, times_and_inputs: tuple[Any, Inputs]):
        x, _ = jax.lax.scan(step, x, times_and_inputs)
        y = plant.output(times_and_inputs[0][-1] + dt, x)
        return x, jnp.concatenate([y.position, body_of(y).nu])

    def window(starts: _Windows, factor: Inputs):
        inputs = factor[None] * starts.inputs
        ran_in, _ = jax.lax.scan(step, starts.before, (starts.time[:before], inputs[:before]))
        start = starts.start._replace(thrusters=ran_in.thrusters, power=ran_in.power)
        after = starts.time[before:].reshape(-1, stride), inputs[before:].reshape(-1, stride, inputs.shape[1])
        return jax.lax.scan(stride_of_steps, start, after)[1]

    return jax.vmap(jax.vmap(window, (0, None)), (None, 0))(windows, factors)
