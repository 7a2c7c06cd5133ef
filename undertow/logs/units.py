"""Units that logs use, as multiples of ours."""

import math
from collections.abc import Iterable
from typing import NamedTuple

from undertow.core.errors import BadInput

_DEGREE = math.pi / 180


class Unit(NamedTuple):
    """A unit.

    Attributes:
        ours: the unit of a log that it belongs to.
        factor: of ours.
    """

    ours: str
    factor: float


UNITS = {
    "m": Unit("m", 1.0),
    "cm": Unit("m", 1e-2),
    "mm": Unit("m", 1e-3),
    "rad": Unit("rad", 1.0),
    "deg": Unit("rad", _DEGREE),
    "cdeg": Unit("rad", 1e-2 * _DEGREE),
    "m/s": Unit("m/s", 1.0),
    "cm/s": Unit("m/s", 1e-2),
    "mm/s": Unit("m/s", 1e-3),
    "rad/s": Unit("rad/s", 1.0),
    "deg/s": Unit("rad/s", _DEGREE),
    "rpm": Unit("rad/s", 2 * math.pi / 60),
    "m/s^2": Unit("m/s^2", 1.0),
    "g": Unit("m/s^2", 9.80665),
    "mg": Unit("m/s^2", 9.80665e-3),
    "V": Unit("V", 1.0),
    "mV": Unit("V", 1e-3),
    "N": Unit("N", 1.0),
    "kgf": Unit("N", 9.80665),
    "gf": Unit("N", 9.80665e-3),
    "lbf": Unit("N", 4.4482216152605),
    "A": Unit("A", 1.0),
    "mA": Unit("A", 1e-3),
    "W": Unit("W", 1.0),
    "kW": Unit("W", 1e3),
    "us": Unit("us", 1.0),
    "1": Unit("1", 1.0),
    "%": Unit("1", 1e-2),
}

TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def factor(unit: str, ours: str, signal: str, others: Iterable[str] = ()) -> float:
    """Factor that turns values of a unit into ours; `others` are further units of the signal, for messages.

    Raises:
        BadInput: the unit is unknown, or measures something else.
    """
    unit_names = [name for name, known_unit in UNITS.items() if known_unit.ours == ours]
    if unit not in unit_names:
        raise BadInput("unit", f"be one of {', '.join((*unit_names, *others))} for `{signal}`", unit)
    return UNITS[unit].factor


def seconds(unit: str) -> float:
    """Seconds of a unit of time.

    Raises:
        BadInput: it is none.
    """
    if unit not in TIMES:
        raise BadInput("unit", f"be one of {', '.join(TIMES)} for the time", unit)
    return TIMES[unit]
