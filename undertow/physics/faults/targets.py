"""Targets of faults: what a closed loop has that can fail, and how it is named.

Names are those of quantities (`position`, `depth`), of sensors (`sensor dvl`, or `dvl` alone where no quantity has that
name), of a thruster (`thruster 3`, or the name that figures give it), `bus`, `plant` and `computation`. A plant that is
no vehicle has `input 1` in place of thrusters.
"""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from undertow.core import catalogue
from undertow.core.contracts import AbstractNavigation, AbstractPlant, Measurement
from undertow.core.errors import BadInput, joined, nearest
from undertow.core.user_code import MODULE_PREFIX
from undertow.physics.faults.quantities import OF_BODY, PROPELLER_SPEED, quantities_of
from undertow.physics.sensors.motion import motion_of
from undertow.physics.sensors.sensor import AbstractSensor
from undertow.physics.vehicles.thruster_labels import number_of, without_number

# Sensor -> unit of its reading, usual size of an error.
_SENSORS = {
    "imu": ("rad, rad/s, m/s^2", 0.2),
    "dvl": ("m/s", 0.2),
    "depth": ("m", 0.5),
    "compass": ("rad", 0.2),
    "position_fix": ("m", 0.5),
    "propeller_speed": ("rad/s", 30.0),
}


class FaultTarget(NamedTuple):
    """Something that can fail.

    Attributes:
        name: as a scenario gives it, without a number.
        role: one of `mode.ROLES`.
        unit: of a severity that is given in the unit of the target.
        size: usual size of an error, for the default severity.
        width: entries of the signal; 0 where it has none, or where the plant is not known.
        places: of a sensor, among those of the filter.
        angles: entries of a reading that are angles.
    """

    name: str
    role: str
    unit: str
    size: float
    width: int = 0
    places: tuple[int, ...] = ()
    angles: tuple[int, ...] = ()


# What others call a target -> its name here; figures call a thruster `T2 bow port`.
_OTHER_WORDS = {
    "t": "thruster",
    "thrusters": "thruster",
    "inputs": "input",
    "power": "bus",
    "controller": "computation",
}

_INPUT_UNIT = "share of the largest input"


def all_targets() -> dict[str, FaultTarget]:
    """Targets that a vehicle may have, by name."""
    quantities = OF_BODY | {"propeller_speed": PROPELLER_SPEED}
    found = [FaultTarget(name, "quantity", one.unit, one.size) for name, one in quantities.items()]
    found += [_sensor(name, 0, ()) for name in sorted(catalogue.names("sensors"))]
    found += _of_inputs("thruster", 0)
    found += [FaultTarget("plant", "plant", "", 1.0), FaultTarget("computation", "computation", "", 1.0)]
    return {one.name: one for one in found}


def targets_of(plant: AbstractPlant, navigation: AbstractNavigation) -> dict[str, FaultTarget]:
    """Targets that a closed loop has, by name."""
    y: Measurement = jax.eval_shape(lambda: plant.output(jnp.zeros(()), plant.initial_state()))
    found = [
        FaultTarget(name, "quantity", one.unit, one.size, len(jax.eval_shape(one.read, y)))
        for name, one in quantities_of(y).items()
    ]
    if sensors := navigation.simulated_sensors():
        names = [_name_of(sensor) for sensor in sensors]
        if "propeller_speed" not in names:  # then the controller gets none
            found = [one for one in found if one.name != "propeller_speed"]
        for name in dict.fromkeys(names):
            places = tuple(place for place, other in enumerate(names) if other == name)
            sensor = sensors[places[0]]
            reading = jax.eval_shape(lambda y, sensor=sensor: sensor.reading(_motion(y)), y)
            found.append(_sensor(name, len(reading), places)._replace(angles=tuple(sensor.angles)))
    found += _of_inputs("thruster" if y.body is not None else "input", plant.inputs())
    if y.body is not None:
        found.append(FaultTarget("plant", "plant", "", 1.0))
    found.append(FaultTarget("computation", "computation", "", 1.0))
    return {one.name: one for one in found}


def _of_inputs(name: str, width: int) -> list[FaultTarget]:
    bus = [FaultTarget("bus", "bus", _INPUT_UNIT, 0.2, width)] if name == "thruster" else []
    return [FaultTarget(name, "thruster", _INPUT_UNIT, 0.2, width), *bus]


def _sensor(name: str, width: int, places: tuple[int, ...]) -> FaultTarget:
    return FaultTarget(f"sensor {name}", "sensor", *_SENSORS.get(name, ("as read", 0.2)), width, places)


def _name_of(sensor: AbstractSensor) -> str:
    """Name of the part that a sensor is: that of its file."""
    return type(sensor).__module__.removeprefix(MODULE_PREFIX).rpartition(".")[2]


def _motion(y: Measurement):
    return motion_of(y, y.velocity[:3], jnp.zeros(()))


def is_target(text: str) -> bool:
    """Whether a text names a target of any vehicle, so that a thruster must not be called so."""
    return _parsed(text, all_targets())[0] in all_targets()


def _parsed(text: str, known: Mapping[str, FaultTarget]) -> tuple[str, str | None]:
    """Name of a target as in `known`, where it is there, and the digits behind it."""
    parsed = re.fullmatch(r"(.*?)[\s_]*(\d+)?", " ".join(text.split()).lower())
    word, digits = (parsed.group(1), parsed.group(2)) if parsed else (text, None)
    word = _OTHER_WORDS.get(word, word)
    word = re.sub(r"^sensors?[\s_]+", "sensor ", word)
    if word not in known and f"sensor {word}" in known:
        word = f"sensor {word}"
    return word, digits


def named(
    text: str, number: int | str | None, known: Mapping[str, FaultTarget], thrusters: Sequence[str] = ()
) -> tuple[FaultTarget, int | str | None]:
    """The target that a text names, and its number: of a thruster, or of a sensor among those of its kind.

    Args:
        text: such as `thruster 3`, `sensor dvl` or `position`, or the name of a thruster.
        number: given beside it; "random" for a thruster that is sampled; None where it is not given.
        known: targets of the loop, by name.
        thrusters: their names, as figures show them: `T3 stern port`.

    Raises:
        BadInput: the loop has no such target; the error names those it has.
    """
    word, digits = _parsed(text, known)
    if word not in known and (place := number_of(text, thrusters)) is not None:
        word, digits = "thruster", str(place)
    if word == "random":
        hint = "Write `number: random` for a random thruster; undertow.physics.faults.sampling makes random entries"
        raise BadInput("target", "be something that can fail", text, hint=hint)
    if word not in known:
        hint = joined(nearest(word, [*known, *thrusters, *map(without_number, thrusters)]), _listed(known, thrusters))
        raise BadInput("target", "be something that this scenario has and that can fail", text, hint=hint)
    target = known[word]
    if digits is not None and number is not None:
        raise BadInput("number", f"be left out: the target is `{text}`", number)
    return target, int(digits) if digits is not None else number


def _listed(known: Mapping[str, FaultTarget], thrusters: Sequence[str]) -> str:
    """Sentence with the targets of a scenario."""
    of_thrusters = f"; its thrusters are {', '.join(thrusters)}" if thrusters else ""
    return f"This scenario has: {', '.join(known)}{of_thrusters}"


def checked_number(target: FaultTarget, number: int | str | None) -> int | str | None:
    """The number of a target, if it may be one.

    Raises:
        BadInput: it is missing, out of range, or the target has none.
    """
    if target.role == "thruster":
        must = f"be from 1 to {target.width}, or random, for a fault of one {target.name}"
        if number is None or (isinstance(number, int) and not 1 <= number <= target.width):
            hint = f"Write `target: {target.name} 1`, for example" if number is None else ""
            raise BadInput("number", must, "not given" if number is None else number, hint=hint)
        return number
    most = len(target.places)
    if number is not None and not (isinstance(number, int) and target.role == "sensor" and 1 <= number <= most):
        must = f"be from 1 to {most}" if most > 1 else f"be left out for `{target.name}`"
        raise BadInput("number", must, number)
    return number
