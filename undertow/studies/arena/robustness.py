"""Robustness of a law: its error over one parameter of the conditions after the other, until it fails.

One vehicle follows the motion of the tasks in a current. Every parameter takes the levels of its row while the others
stay as they are.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.studies.arena.entry import campaign_of
from undertow.studies.arena.scores import trial_errors
from undertow.studies.arena.tasks import METRICS, Keys, motion_keys
from undertow.studies.arena.tuned_gains import TunedGains, controller_of
from undertow.studies.arena.vehicles import VEHICLES
from undertow.studies.campaign.prepare import Prepared
from undertow.studies.campaign.store_results import load
from undertow.studies.comparison.candidates import Candidate

VEHICLE = "bluerov2_heavy"
FOLDER = "robustness"  # inside that of a law


class ConditionParameter(NamedTuple):
    """A parameter of the conditions.

    Attributes:
        label: for axes, with its unit.
        levels: from mild to hard.
        keys: those of the scenario at a level.
    """

    label: str
    levels: tuple[float, ...]
    keys: Callable[[float], Keys]


def _error(**factors: float) -> Keys:
    """Fixed factors on mass, damping or thrust of the vehicle, which the nominal model does not know."""
    ones = dict.fromkeys(("mass", "damping", "restoring", "thrust"), 1.0) | factors
    return {"kind": "parameter_error", **{name: [one, one] for name, one in ones.items()}}


def _load(*more: Keys) -> Keys:
    return {"disturbance": [motion_keys(VEHICLE)["disturbance"][0], *more]}


def _current(speed: float) -> Keys:
    return {"disturbance": [{"kind": "current", "velocity": [0.8 * speed, 0.6 * speed, 0]}]}


def _noise(deviation: float) -> Keys:
    return {"navigation": {"kind": "degraded", "velocity_noise": deviation, "position_noise": 0.1 * deviation}}


def _delay(delay: float) -> Keys:
    return {"navigation": {"kind": "degraded", "delay": delay}}


def _supply(supply: float) -> Keys:
    known = VEHICLES[VEHICLE].thruster
    plant = motion_keys(VEHICLE)["plant"] | {"thruster": known | {"supply": supply}}
    return {"plant": plant, "model": {"thruster": known}}


PARAMETERS = {
    "waves": ConditionParameter(
        "significant wave height, m",
        (0.2, 0.4, 0.6, 0.9, 1.3, 2.0, 3.0),
        lambda height: _load({"kind": "waves", "height": height, "period": 5, "depth": 3}),
    ),
    "current": ConditionParameter("speed of the current, m/s", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8), _current),
    "speed": ConditionParameter(
        "largest speed of the motion, m/s",
        (0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 0.9),
        lambda speed: motion_keys(VEHICLE, speed / VEHICLES[VEHICLE].speed),
    ),
    "delay": ConditionParameter("delay of the measurements, s", (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5), _delay),
    "noise": ConditionParameter(
        "noise of the velocities, m/s and rad/s", (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2), _noise
    ),
    "mass": ConditionParameter(
        "mass of the vehicle / that of the model",
        (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0),
        lambda factor: _load(_error(mass=factor)),
    ),
    "damping": ConditionParameter(
        "drag of the vehicle / that of the model",
        (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0),
        lambda factor: _load(_error(damping=factor)),
    ),
    "strong": ConditionParameter(
        "thrust above that of the model, as a ratio",
        (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0),
        lambda factor: _load(_error(thrust=factor)),
    ),
    "weak": ConditionParameter(
        "thrust below that of the model, as a ratio",
        (1.0, 0.85, 0.7, 0.6, 0.5, 0.4, 0.3),
        lambda factor: _load(_error(thrust=factor)),
    ),
    "supply": ConditionParameter("supply, V (the model has 16 V)", (16, 14, 12, 11, 10, 9, 8), _supply),
}


class RobustnessCurve(NamedTuple):
    """Error of a law over a parameter.

    Attributes:
        levels: of the parameter.
        middle, low, high: median, smallest and largest error of the trials at each level, in tolerances, at most 10.
    """

    levels: tuple[float, ...]
    middle: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def last(self) -> float:
        """The hardest level up to which every trial is within the tolerance at all levels; NaN where none is."""
        beyond = np.flatnonzero(self.high > 1)
        number = int(beyond[0]) if len(beyond) else len(self.levels)
        return self.levels[number - 1] if number else math.nan

    def data(self) -> dict[str, Any]:
        """The same as lists of numbers."""
        return {name: list(map(float, column)) for name, column in self._asdict().items()}


def prepare_robustness(law: Candidate, trials: int, gains: TunedGains | None) -> Prepared:
    """The campaign of a law: a variant for every level of every parameter.

    Args:
        law: the law.
        trials: at every level.
        gains: tuned for each vehicle; None for those that the law has by itself.

    Raises:
        BadInput: the law does not accept the vehicle.
    """
    part = {"controller": controller_of(law, VEHICLE, gains)}
    same = {"navigation": "perfect", "model": {}} | motion_keys(VEHICLE) | part
    scenarios = {
        _variant(name, level): same | one.keys(level) for name, one in PARAMETERS.items() for level in one.levels
    }
    return campaign_of(scenarios, trials)


def curves(folder: Path) -> dict[str, RobustnessCurve]:
    """Error over every parameter, from the folder of the campaign.

    Raises:
        BadInput, OSError: the results are damaged.
    """
    results = load(folder)
    tolerances = [motion_keys(VEHICLE)["success"][name] for name in METRICS]
    names = [name for (name,) in map(results.named, range(results.campaign.number // results.campaign.trials))]
    position, orientation = (results.rows[name].values.astype(float) for name in METRICS)
    errors = trial_errors(position, orientation, tolerances)
    at = lambda name, level: errors[results.combinations == names.index(_variant(name, level))]
    return {name: _curve(one.levels, [at(name, level) for level in one.levels]) for name, one in PARAMETERS.items()}


def _curve(levels: tuple[float, ...], errors: Sequence[np.ndarray]) -> RobustnessCurve:
    of = lambda function: np.array([function(one) if len(one) else np.nan for one in errors])
    return RobustnessCurve(levels, of(np.median), of(np.min), of(np.max))


def _variant(name: str, level: float) -> str:
    return f"{name} {level:g}"
