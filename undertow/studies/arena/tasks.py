"""The fifteen tasks of the arena. A change of any of them, or of a vehicle, is another version of the arena."""

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from undertow.studies.arena.vehicles import VEHICLES, ArenaVehicle

VERSION = 3

METRICS = ("position_rms", "orientation_rms")  # those that have tolerances

Keys = dict[str, Any]  # keys of a scenario

_ONSET, _START, _DURATION = 20.0, 20.0, 60.0  # s: of what happens, of the evaluated window, of the run
_LOOP = {"dt": 0.01, "duration": _DURATION, "record": 1.0}  # s
_LEVEL = [0.0] * 6

# In every task the vehicle is another one in each trial, near the model.
_NEAR = {"kind": "parameter_error", "mass": [0.9, 1.1], "damping": [0.7, 1.3], "restoring": [1, 1]}
_NEAR |= {"thrust": [0.9, 1.1]}


class Task(NamedTuple):
    """A task.

    Attributes:
        question: what it asks of a law, in words.
        keys: those of the scenario in which it differs from the others, for a vehicle.
        vehicles: that have it.
        orientation: tolerance of the angle between attitude and reference, rad, where it is not that of the vehicle.
        foreign: whether each published set of the vehicle is simulated under each other one as the model.
    """

    question: str
    keys: Callable[[ArenaVehicle], Keys]
    vehicles: tuple[str, ...] = tuple(VEHICLES)
    orientation: float | None = None
    foreign: bool = False


def _plant(v: ArenaVehicle, name: str) -> Keys:
    return {"kind": "hybrid_vehicle", "vehicle": name, "thruster": v.thruster, "ledger": False}


def _current(v: ArenaVehicle) -> Keys:
    return {"kind": "current", "velocity": list(v.current)}


def _waves(v: ArenaVehicle) -> Keys:
    return {"kind": "waves", "height": v.waves, "period": 5, "depth": 3}


def _station() -> Keys:
    return {"kind": "setpoint", "position": _LEVEL}


def _motion(v: ArenaVehicle, speed: float = 1.0) -> Keys:
    """A repeated motion in surge, sway, heave and yaw, whose largest speed is `speed` times that of the vehicle."""
    rate = speed * v.speed / v.reach
    amplitude = [v.reach, 0.5 * v.reach, 0.3 * v.reach, 0.5]
    return {"kind": "lissajous", "amplitude": amplitude, "frequency": [0.8 * rate, 1.0 * rate, 0.6 * rate, 0.4 * rate]}


def _station_keeping(v: ArenaVehicle) -> Keys:
    return {"reference": _station(), "disturbance": [_current(v), _waves(v)]}


def _current_step(v: ArenaVehicle) -> Keys:
    speed = 2 * math.hypot(*v.current)
    fault = {"target": "plant", "mode": "current_step", "onset": _ONSET, "severity": speed}
    return {"reference": _station(), "disturbance": [], "faults": [fault]}


def _lawn_mower(v: ArenaVehicle) -> Keys:
    survey = {"kind": "lawn_mower", "length": 3 * v.reach, "spacing": v.reach, "count": 4, "speed": v.speed}
    return {"reference": survey | {"heading": "along"}, "disturbance": [_current(v)]}


def _pitch_turn(v: ArenaVehicle) -> Keys:
    over = {"kind": "setpoint", "position": [0.0, 0.0, 0.0, 0.0, 2.0, 0.0], "settling": 6}
    return {"reference": over, "disturbance": [_current(v)], "steady": {"start": 0.0}}


def _payload(v: ArenaVehicle) -> Keys:
    return {"reference": _station(), "disturbance": [_current(v), {"kind": "payload", "start": _ONSET, **v.payload}]}


def _dead_thruster(v: ArenaVehicle) -> Keys:
    loss = {"target": "thruster", "number": "random", "mode": "fraction", "severity": 0, "onset": _ONSET}
    return {"reference": _motion(v), "disturbance": [_current(v)], "faults": [loss]}


def _wrong_model(v: ArenaVehicle) -> Keys:
    other = {"mass": [0.8, 1.25], "damping": [0.5, 2], "thrust": [0.8, 1.2]}
    return {"reference": _motion(v), "disturbance": [_current(v), _NEAR | other], "model": v.model}


def _noise(v: ArenaVehicle) -> Keys:
    sensors = [
        "imu",
        {"kind": "dvl", "period": 0.2, "noise": 0.01, "delay": 0.05},
        "depth",
        "compass",
        {"kind": "position_fix", "period": 1, "noise": 0.05, "delay": 0.2},
    ]
    navigation = {"kind": "observer", "sensors": sensors}
    return {"reference": _motion(v), "disturbance": [_current(v), _waves(v)], "navigation": navigation}


def _delay(v: ArenaVehicle) -> Keys:
    return {"reference": _motion(v), "disturbance": [_current(v)], "navigation": {"kind": "degraded", "delay": 0.1}}


def _low_battery(v: ArenaVehicle) -> Keys:
    return {
        "reference": _motion(v, 1.5),
        "disturbance": [_current(v), _waves(v)],
        "plant.thruster": v.thruster | v.low,
        "model": {"thruster": v.thruster},
    }


def _tether(v: ArenaVehicle) -> Keys:
    # Slack but for the far end of the motion, where it pulls about as much as the payload weighs.
    anchor, stiffness = [-3 * v.reach, 0, -2 * v.reach], 5 * v.payload["weight"] / v.reach
    cable = {"kind": "tether", "anchor": anchor, "length": 4.4 * v.reach, "stiffness": stiffness, "drag": 4}
    return {"reference": _motion(v), "disturbance": [_current(v), cable]}


def _underactuated(v: ArenaVehicle) -> Keys:
    return {"reference": _motion(v), "disturbance": [_current(v)], "plant.thrusters": list(v.two_lost)}


def _at_rate(rate: float) -> Callable[[ArenaVehicle], Keys]:
    """A motion and a current that are fast enough for a wrong model to matter, with a controller of this rate, Hz."""

    def keys(v: ArenaVehicle) -> Keys:
        current = _current(v) | {"velocity": [2 * one for one in v.current]}
        return {"reference": _motion(v, 1.5), "disturbance": [current], "loop": _LOOP | {"dt": 1 / rate}}

    return keys


def _foreign_model(rate: float) -> Task:
    question = f"follow a fast motion at {rate:g} Hz with the model of another publication"
    return Task(question, _at_rate(rate), tuple(name for name, v in VEHICLES.items() if v.sets), foreign=True)


TASKS: Mapping[str, Task] = {
    "station_keeping": Task("keep station in waves and a current", _station_keeping),
    "current_step": Task("keep station when a current sets in at once", _current_step),
    "lawn_mower": Task("follow the legs of a survey, turning into each", _lawn_mower),
    "pitch_turn": Task(
        "turn through a pitch of 90 degrees, where Euler angles are singular",
        _pitch_turn,
        tuple(name for name, v in VEHICLES.items() if v.pitches),
    ),
    "payload": Task("keep station when a payload is picked up", _payload),
    "dead_thruster": Task("follow a motion when a thruster, another one in each trial, dies unnoticed", _dead_thruster),
    "wrong_model": Task("follow a motion with mass, drag and thrust other than those of the model", _wrong_model),
    "noise": Task("follow a motion in waves, navigating by an observer of noisy, slow and late readings", _noise),
    "delay": Task("follow a motion with measurements that are 0.1 s old", _delay),
    "low_battery": Task("follow a fast motion in waves with less supply than the model has", _low_battery),
    "tether": Task("follow a motion on a cable with drag that also pulls", _tether),
    "underactuated": Task(
        "follow a motion with six thrusters, which cannot give every moment",
        _underactuated,
        orientation=math.radians(90),
    ),
    "foreign_20_hz": _foreign_model(20),
    "foreign_50_hz": _foreign_model(50),
    "foreign_100_hz": _foreign_model(100),
}


def scenarios(task: str, vehicle: str) -> dict[str, Keys]:
    """The scenarios of a task on a vehicle, but for the controller, by the names that they have in a campaign.

    There is one, or one for each pair of published sets where the task has foreign models.
    """
    keys = _scenario_keys(task, vehicle)
    if not TASKS[task].foreign:
        return {f"{task} {vehicle}": keys}
    return {
        f"{task} {vehicle} {true} under {model}": keys
        | {
            "plant": keys["plant"] | {"vehicle": {"kind": vehicle, "parameters": true}},
            "model": {"vehicle": {"kind": vehicle, "parameters": model}},
        }
        for true, model in itertools.permutations(VEHICLES[vehicle].sets, 2)
    }


def tolerances(task: str, vehicle: str) -> tuple[float, float]:
    """Tolerances of position (m) and orientation (rad)."""
    v = VEHICLES[vehicle]
    return v.position, TASKS[task].orientation or v.orientation


def _scenario_keys(task: str, vehicle: str) -> Keys:
    """Every key is given, so that tasks can be the variants of one campaign."""
    v, one = VEHICLES[vehicle], TASKS[task]
    plant = _plant(v, vehicle)
    usual = {"navigation": "perfect", "faults": [], "model": {}, "steady": {"start": _START}, "loop": _LOOP}
    keys = usual | one.keys(v)
    for option in ("thruster", "thrusters"):
        if (value := keys.pop(f"plant.{option}", None)) is not None:
            plant[option] = value
    if _NEAR["kind"] not in [one["kind"] for one in keys["disturbance"]]:
        keys["disturbance"] = [*keys["disturbance"], _NEAR]
    if keys["model"].keys() - {"thruster"}:
        keys["model"] = {"vehicle": {"kind": vehicle, **keys["model"]}}
    success = dict(zip(METRICS, tolerances(task, vehicle), strict=True))
    return keys | {"plant": plant, "success": success}


def motion_keys(vehicle: str, speed: float = 1.0) -> Keys:
    """The motion of the tasks in a current with no other load, its speed times a factor."""
    v = VEHICLES[vehicle]
    return {
        "plant": _plant(v, vehicle),
        "reference": _motion(v, speed),
        "disturbance": [_current(v)],
        "success": dict(zip(METRICS, (v.position, v.orientation), strict=True)),
        "steady": {"start": _START},
        "loop": _LOOP,
    }


def training_keys(vehicle: str) -> Keys:
    """The scenario that a law is tuned on for a vehicle: another motion, sea and current than those of the tasks."""
    v = VEHICLES[vehicle]
    water = [{"kind": "current", "velocity": [-v.current[1], v.current[0], 0]}, _waves(v) | {"height": 0.7 * v.waves}]
    return {
        "plant": _plant(v, vehicle),
        "reference": _motion(v, 0.7),
        "disturbance": [*water, _NEAR],
        "loop": _LOOP | {"duration": 20.0},
        "tune": {"position_scale": v.position, "angle_scale": v.orientation},
        "seed": 1000,
    }


CELLS = tuple((task, vehicle) for task, one in TASKS.items() for vehicle in one.vehicles)
