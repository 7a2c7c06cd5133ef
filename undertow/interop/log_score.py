"""How well the model of a vehicle predicts a logged motion over some seconds, from the logged thruster commands.

Every few seconds of a log the model starts from the logged pose and velocity, is driven by the logged commands, and is
compared with the logged motion after each horizon. Rotors are run in before the start, with the commands of the two
seconds before.
"""

import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core import checks
from undertow.core.contracts import Inputs, Outputs
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_OUTPUTS, body_of
from undertow.core.runtime import on_processor
from undertow.logs.log import Log, Series
from undertow.logs.motion import LoggedMotion, inputs_of, motion_of
from undertow.loop.closed_loop import Realization
from undertow.numerics.integrators import METHODS
from undertow.numerics.random_keys import key_of_seed
from undertow.plants.hybrid_vehicle import HybridVehicle, VehicleState
from undertow.scenario.build import Built, in_its_precision

AXES = (*BODY_OUTPUTS, "surge", "sway", "heave", "p", "q", "r")
UNITS = (*("m",) * 3, *("rad",) * 3, *("m/s",) * 3, *("rad/s",) * 3)

HORIZONS = (1.0, 5.0, 10.0)  # s
EVERY = 5.0  # s between starts

_RUN_IN = 2.0  # s; rotors forget within tenths of a second
_CURVE = 0.1  # s between points of the error over the horizon
_ROUNDING = 1e-9  # share of a horizon
_ENDLESS = 1e15  # m, rad, m/s or rad/s; a prediction beyond it has diverged
_EARLY = 1e-2  # share of the median interval by which a command counts early, as in controllers/replay.py


class Score(NamedTuple):
    """Errors of prediction.

    Attributes:
        horizons: s.
        rms: of each axis of `AXES` over all starts, shape (horizons, 12); in `UNITS`.
        starts: times of the log at which the model started, s.
        curve: times after the start, s.
        growth: rms at these times, shape (times, 12).
    """

    horizons: tuple[float, ...]
    rms: np.ndarray
    starts: np.ndarray
    curve: np.ndarray
    growth: np.ndarray

    def summary(self) -> dict[str, Any]:
        """All of it for a JSON file."""
        rows = {f"{horizon:g}": dict(zip(AXES, row.tolist(), strict=True)) for horizon, row in self._rows()}
        return {"starts": self.starts.tolist(), "units": dict(zip(AXES, UNITS, strict=True)), "rms": rows}

    def _rows(self):
        return zip(self.horizons, self.rms, strict=True)

    def __repr__(self) -> str:
        return f"Score over {len(self.starts)} starts: {json.dumps(self.summary()['rms'])}"


@in_its_precision
def score(built: Built, log: Log, horizons: Sequence[float] = HORIZONS, every: float = EVERY) -> Score:
    """Errors of the model of a scenario's vehicle, over horizons.

    The scenario gives vehicle, thrusters, disturbance, step and seed; its controller, reference and navigation do not
    matter.

    Args:
        built: the scenario.
        log: with the motion and the inputs.
        horizons: s; from the step of the curve on, about 0.1 s.
        every: s between starts.

    Raises:
        BadInput: the plant is no vehicle, the log is of another one or too short, horizons are too short, or the model
            diverges.
    """
    plant, loop = built.closed_loop.plant, built.scenario.loop
    if not isinstance(plant, HybridVehicle):
        raise BadInput("plant", "be a vehicle with thrusters", f"a {type(plant).__name__}")
    checks.positive("horizons", horizons, "s")
    checks.positive("every", every, "s")
    motion = motion_of(log)
    inputs = inputs_of(log, ("input", "commanded_input"), np.asarray(plant.thruster_matrix))
    if not (np.isfinite(motion.outputs).all() and np.isfinite(motion.nu).all()):
        raise BadInput("log", "have attitudes and velocities that are finite", f"{log.source}, where one never is")
    if inputs.values.shape[1] != plant.inputs():
        must = f"have {plant.inputs()} inputs, as many as the vehicle has thrusters"
        hint = "Map one column per thruster to `input`, or take the vehicle of the log"
        raise BadInput("log", must, f"{log.source} with {inputs.values.shape[1]}", hint=hint)
    stride = max(1, round(_CURVE / loop.dt))
    spacing = loop.dt * stride
    if min(horizons) < spacing * (1 - _ROUNDING):
        raise BadInput("horizons", f"be {spacing:g} s or longer, the step of the curve", f"{min(horizons):g} s")
    steps = math.ceil(max(horizons) / spacing * (1 - _ROUNDING)) * stride
    starts = _starts(motion, inputs, log, loop.dt * steps, every)
    before = round(_RUN_IN / loop.dt)
    times = starts[:, None] + loop.dt * np.arange(-before, steps)
    with on_processor():
        realization = built.closed_loop.realize(key_of_seed(built.scenario.seed))
        given = _Windows(
            time=jnp.asarray(times - motion.time[0]),
            inputs=jnp.asarray(held(inputs, times)),
            before=_states(plant, motion, times[:, 0]),
            start=_states(plant, motion, starts),
        )
        settings = (before, stride, loop.method if loop.method in METHODS else "rk4", loop.substeps)
        limited = "input" not in log
        predicted = jax.device_get(_predicted(realization, given, jnp.asarray(loop.dt, dtype=float), limited, settings))
    after = spacing * np.arange(1, steps // stride + 1)
    _check_finite(np.asarray(predicted), after, log)
    errors = np.asarray(predicted, dtype=float) - _logged(motion, starts[:, None] + after)
    errors[..., 3:6] -= 2 * np.pi * np.round(errors[..., 3:6] / (2 * np.pi))
    growth = np.sqrt((errors**2).mean(axis=0))
    rms = np.stack([np.interp(horizons, after, column) for column in growth.T], axis=1)
    return Score(tuple(map(float, horizons)), rms, starts, after, growth)


def _check_finite(predicted: np.ndarray, after: np.ndarray, log: Log) -> None:
    """Check that a prediction, of shape (starts, times, 12), stays below what can be squared.

    Raises:
        BadInput: it does not.
    """
    good = (np.abs(predicted) < _ENDLESS).all(axis=(0, 2))  # false for NaN
    if not good.all():
        got = f"{log.source}, with which it diverges within {after[np.argmin(good)]:.4g} s of a start"
        hint = "Check the units of the inputs, and their order: pulses that are declared as volts are 1500 V"
        raise BadInput("log", "have motions and inputs with which the model stays finite", got, hint=hint)


class _Windows(NamedTuple):
    """What the starts differ in; each with a leading axis over them."""

    time: Any  # of each step, s
    inputs: Any  # held over each step
    before: VehicleState  # where the rotors are run in
    start: VehicleState


def _starts(motion: LoggedMotion, inputs: Series, log: Log, longest: float, every: float) -> np.ndarray:
    """Times at which the model starts: samples of the motion, with commands before and a motion to compare after."""
    first = max(motion.time[0], inputs.time[0]) + _RUN_IN
    last = min(motion.time[-1], inputs.time[-1]) - longest
    tolerance = 1e-9 * max(1.0, abs(last))
    if first > last + tolerance:
        needed = _RUN_IN + longest
        got = f"{log.source}, which has both for {last + longest - first + _RUN_IN:.4g} s"
        raise BadInput("log", f"have motion and inputs together for {needed:g} s or longer", got)
    asked = np.arange(first, last + tolerance, every)
    places = np.searchsorted(motion.time, asked - tolerance).clip(0, len(motion.time) - 1)
    found = np.unique(motion.time[places])
    return found[found <= last + tolerance]


def held(inputs: Series, times: np.ndarray) -> np.ndarray:
    """Inputs at times: those of the last sample until then."""
    early = _EARLY * np.median(np.diff(inputs.time))
    places = np.searchsorted(inputs.time, times + early, side="right") - 1
    return inputs.values[places.clip(0, len(inputs.time) - 1)]


def _logged(motion: LoggedMotion, times: np.ndarray) -> np.ndarray:
    """Outputs and body velocity of the log at times, linear between samples."""
    rows = np.hstack([motion.outputs, motion.nu])
    return np.stack([np.interp(times, motion.time, column) for column in rows.T], axis=-1)


def _states(plant: HybridVehicle, motion: LoggedMotion, times: np.ndarray) -> VehicleState:
    """States of the vehicle at times of the log, rotors at rest."""
    rows = jnp.asarray(_logged(motion, times))

    def state(row: Outputs) -> VehicleState:
        return plant.initial_state(row[:6])._replace(nu=row[6:])

    return jax.jit(jax.vmap(state))(rows)


@eqx.filter_jit
def _predicted(realization: Realization, windows: _Windows, dt, limited: bool, settings: tuple[int, int, str, int]):
    """Outputs and body velocity after every stride of each window."""
    before, stride, method, substeps = settings
    plant, integrate = realization.loop.plant, METHODS[method]

    def step(x: VehicleState, given: tuple[Any, Inputs]):
        t, u = given
        u = plant.admissible(x, u) if limited else u
        h = dt / substeps
        for i in range(substeps):
            x = integrate(lambda t, x: realization.motion(jnp.asarray(t), x, u), t + i * h, x, h)
        return x, None

    def several(x: VehicleState, given: tuple[Any, Inputs]):
        x, _ = jax.lax.scan(step, x, given)
        y = plant.output(given[0][-1] + dt, x)
        return x, jnp.concatenate([y.position, body_of(y).nu])

    def window(one: _Windows):
        ran_in, _ = jax.lax.scan(step, one.before, (one.time[:before], one.inputs[:before]))
        start = one.start._replace(thrusters=ran_in.thrusters, power=ran_in.power)
        rest = one.time[before:].reshape(-1, stride), one.inputs[before:].reshape(-1, stride, one.inputs.shape[1])
        return jax.lax.scan(several, start, rest)[1]

    return jax.vmap(window)(windows)
