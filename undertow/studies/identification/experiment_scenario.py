"""The scenario of an experiment: the vehicle of another one, a law that keeps the place, and a script."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from undertow.scenario.build import Built
from undertow.scenario.csv_table import csv_of

# Keeps the place of a vehicle within metres, and the attitude more firmly: weaker than a pilot, so that the motion is
# that of the script; without compensation, whose errors are those of the numbers that are looked for.
LAW: dict[str, Any] = {
    "kind": "pid",
    "frequency": [0.5, 0.5, 0.6, 2.5, 2.5, 1.0],
    "feedforward": False,
    "reference_frequency": 0,
}
_KEPT = ("plant", "model", "disturbance", "navigation", "seed", "precision")
LEAD = 12.0  # s until the law has trimmed the vehicle and the script begins; the second segment of an identification
REST = 2.0  # s after the script
_ABOVE = 0.5  # m of water over the room
_LATER = 1.2  # limits of the supervisor, which stops the law, as multiples of those that only end the script


class ExperimentLimits(NamedTuple):
    """Where an experiment has to stay, and what ends it.

    Attributes:
        room: m, along the heading of the target, across, and vertical.
        depth: smallest and largest coordinate `down`, m.
        rate: rad/s.
        angle: roll, pitch, and departure from the heading, rad.
        input: of a thruster, in its unit.
    """

    room: tuple[float, float, float]
    depth: tuple[float, float]
    rate: float
    angle: float
    input: float

    def options(self) -> dict[str, Any]:
        """The same as options of the controller `experiment`."""
        least, greatest = self.depth
        return {
            "room": list(self.room),
            "min_depth": least,
            "max_depth": greatest,
            "max_rate": self.rate,
            "max_angle": self.angle,
            "max_input": self.input,
        }


def station_of(built: Built, room: tuple[float, float, float], depth: float | None) -> list[float]:
    """The place that is kept: where the reference of a scenario begins, level, and deep enough for the room."""
    position = np.asarray(built.reference.at(jnp.zeros(())).position, dtype=float)
    deep_enough = max(float(position[2]), room[2] / 2 + _ABOVE)
    return [
        float(position[0]),
        float(position[1]),
        deep_enough if depth is None else depth,
        0.0,
        0.0,
        float(position[5]),
    ]


def experiment_scenario(
    built: Built, rows: np.ndarray, station: list[float], limits: ExperimentLimits | None = None
) -> dict[str, Any]:
    """Scenario as plain data, in which nothing depends on another file.

    Args:
        built: scenario with the vehicle, its surroundings and its navigation.
        rows: script.
        station: place that is kept.
        limits: None for none.
    """
    period = built.scenario.loop.dt if built.scenario.loop.kind == "sampled" else built.scenario.loop.record
    duration = period * np.ceil((rows[-1, 0] + REST) / period - 1e-9)
    controller = {"kind": "experiment", "csv": csv_of(rows), "law": LAW}
    return {
        "description": "experiment for identification",
        **{key: built.resolved[key] for key in _KEPT if key in built.resolved},
        "controller": controller | ({} if limits is None else limits.options()),
        "reference": {"kind": "setpoint", "position": station},
        "initial": {"position": list(station)},
        "loop": {"dt": period, "duration": float(duration), "record": period},
    }


def with_supervisor(built: Built, scenario: Mapping[str, Any], limits: ExperimentLimits) -> dict[str, Any]:
    """The scenario of an experiment under supervision, whose tracking errors are allowed what the limits allow.

    Args:
        built: scenario, whose supervisor is kept if it has one.
        scenario: of the experiment.
        limits: of the experiment.
    """
    allowed = {
        "max_position_error": _LATER * float(np.linalg.norm(limits.room)) / 2,
        "max_angle_error": _LATER * float(np.sqrt(3)) * limits.angle,
    }
    return {**scenario, "supervisor": {"kind": "supervisor", **built.resolved.get("supervisor", {}), **allowed}}
