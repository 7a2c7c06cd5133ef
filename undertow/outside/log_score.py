"""How well the model of a vehicle predicts a logged motion over some seconds, from the logged thruster commands.

Every few seconds of a log the model starts from the logged pose and velocity, is driven by the logged commands, and is
compared with the logged motion after each horizon. Rotors are run in before the start, with the commands of the two
seconds before.
"""

import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_OUTPUTS
from undertow.logs.log import Log
from undertow.logs.motion import inputs_of, motion_of
from undertow.outside.log_prediction import RUN_IN, logged, predict, starts_of, time_together
from undertow.outside.log_signs import warnings_of_signs
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.scenario_vehicle import vehicle_of

AXES = (*BODY_OUTPUTS, "surge", "sway", "heave", "p", "q", "r")
UNITS = (*("m",) * 3, *("rad",) * 3, *("m/s",) * 3, *("rad/s",) * 3)

HORIZONS = (1.0, 5.0, 10.0)  # s
EVERY = 5.0  # s between starts

_CURVE = 0.1  # s between points of the error over the horizon
_ROUNDING = 1e-9  # share of a horizon
_ENDLESS = 1e15  # m, rad, m/s or rad/s; a prediction beyond it has diverged


class PredictionScore(NamedTuple):
    """Errors of prediction.

    Attributes:
        horizons: s.
        rms: of each axis of `AXES` over all starts, shape (horizons, 12); in `UNITS`.
        starts: times of the log at which the model started, s.
        curve: times after the start, s.
        growth: rms at these times, shape (times, 12).
        warnings: sentences on thrusters that seem to be mapped wrongly.
    """

    horizons: tuple[float, ...]
    rms: np.ndarray
    starts: np.ndarray
    curve: np.ndarray
    growth: np.ndarray
    warnings: tuple[str, ...] = ()

    def summary(self) -> dict[str, Any]:
        """All of it for a JSON file."""
        rows = {f"{horizon:g}": dict(zip(AXES, row.tolist(), strict=True)) for horizon, row in self._rows()}
        units = dict(zip(AXES, UNITS, strict=True))
        return {"starts": self.starts.tolist(), "units": units, "rms": rows, "warnings": list(self.warnings)}

    def _rows(self):
        return zip(self.horizons, self.rms, strict=True)

    def __repr__(self) -> str:
        return f"Score over {len(self.starts)} starts: {json.dumps(self.summary()['rms'])}"


@in_its_precision
def score(built: Built, log: Log, horizons: Sequence[float] = HORIZONS, every: float = EVERY) -> PredictionScore:
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
    plant = vehicle_of(built)
    loop = built.scenario.loop
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
    longest = loop.dt * steps
    starts = starts_of(motion, inputs, longest, every)
    if not starts.size:
        got = f"{log.source}, which has both for {time_together(motion, inputs):.4g} s"
        raise BadInput("log", f"have motion and inputs together for {RUN_IN + longest:g} s or longer", got)
    limited = "input" not in log
    as_logged = np.ones((1, plant.inputs()))
    prediction = predict(built, motion, inputs, starts, steps, stride, limited, as_logged)
    predicted = prediction.motion[0]
    after = prediction.after
    _check_finite(predicted, after, log)
    errors = np.asarray(predicted, dtype=float) - logged(motion, starts[:, None] + after)
    errors[..., 3:6] -= 2 * np.pi * np.round(errors[..., 3:6] / (2 * np.pi))
    growth = np.sqrt((errors**2).mean(axis=0))
    rms = np.stack([np.interp(horizons, after, column) for column in growth.T], axis=1)
    warnings = warnings_of_signs(built, motion, inputs, limited)
    return PredictionScore(tuple(map(float, horizons)), rms, starts, after, growth, warnings)


def _check_finite(predicted: np.ndarray, after: np.ndarray, log: Log) -> None:
    """Check that a prediction, of shape (starts, times, 12), stays below what can be squared.

    Raises:
        BadInput: it does not.
    """
    is_bounded = (np.abs(predicted) < _ENDLESS).all(axis=(0, 2))  # false for NaN
    if not is_bounded.all():
        got = f"{log.source}, with which it diverges within {after[np.argmin(is_bounded)]:.4g} s of a start"
        hint = "Check the units of the inputs, and their order: pulses that are declared as volts are 1500 V"
        raise BadInput("log", "have motions and inputs with which the model stays finite", got, hint=hint)
