"""What the columns of a bench record are: a quantity and its unit, from the words of the header.

`pwm_us`, `PWM (us)`, `Force (Kg f)`, `thrust_N`, `Current (A)`, `rpm` and the like are known.
"""

import re
from collections.abc import Iterable
from typing import NamedTuple

from undertow.core.errors import BadInput
from undertow.logs.units import TIMES, UNITS

# Words of a header, by quantity, in the order in which they are looked for.
_WORDS = {
    "thrust": "thrust force load",
    "speed": "rpm speed omega",
    "current": "current amps ampere amperes",
    "power": "power watts",
    "supply": "supply battery bus vbat vin",
    "pulse": "pwm pulse pulses esc servo",
    "duty": "duty throttle",
    "time": "time t timestamp stamp elapsed",
    "voltage": "voltage volts volt v",
    "command": "command cmd input u",
}
_WORDS_OF = {quantity: frozenset(words.split()) for quantity, words in _WORDS.items()}
_NOT_THESE = frozenset("efficiency temperature torque".split())

# Units as headers spell them, without blanks and in small letters.
_SPELLINGS = {
    "\u00b5s": "us",
    "\u03bcs": "us",
    "usec": "us",
    "microseconds": "us",
    "kg": "kgf",
    "lb": "lbf",
    "lbs": "lbf",
    "newton": "N",
    "newtons": "N",
    "n": "N",
    "v": "V",
    "volts": "V",
    "mv": "mV",
    "a": "A",
    "amps": "A",
    "ma": "mA",
    "w": "W",
    "watts": "W",
    "kw": "kW",
    "rad_s": "rad/s",
    "percent": "%",
    "sec": "s",
    "seconds": "s",
}
_OURS = {"thrust": "N", "speed": "rad/s", "current": "A", "power": "W", "supply": "V", "voltage": "V", "pulse": "us"}
_OURS |= {"duty": "1", "time": "s"}
# Units of columns whose header names none.
_USUAL = {"current": "A", "power": "W", "supply": "V", "voltage": "V", "pulse": "us", "duty": "1", "time": "s"}


class BenchColumn(NamedTuple):
    """A column of a bench record.

    Attributes:
        name: as the header has it.
        quantity: thrust, speed, current, power, supply, pulse, duty, time, voltage or command.
        unit: as `logs.units` has it; "" where the header names none.
    """

    name: str
    quantity: str
    unit: str

    @property
    def factor(self) -> float:
        """Of our unit.

        Raises:
            BadInput: the unit is not known, or is none of the quantity.
        """
        unit = self.unit or _USUAL.get(self.quantity, "")
        ours = _OURS.get(self.quantity, "")
        if self.quantity == "time" and unit in TIMES:
            return TIMES[unit]
        known = [name for name, entry in UNITS.items() if entry.ours == ours]
        if unit not in known:
            got = f"{self.name}, which names none" if not unit else f"{self.name} in {unit}"
            hint = f"Name the unit in the header, as {self.quantity}_{known[0].replace('/', '_')}"
            raise BadInput("bench", f"say the unit of {self.quantity}: {', '.join(known)}", got, hint=hint)
        return UNITS[unit].factor


def columns_of(header: Iterable[str]) -> dict[str, BenchColumn]:
    """The columns of a header by quantity; of several with the same quantity the one in our unit.

    Raises:
        BadInput: two columns are the same quantity in the same unit.
    """
    columns: dict[str, BenchColumn] = {}
    for name in header:
        column = _column(name)
        if column is None:
            continue
        other = columns.get(column.quantity)
        if other is not None and other.unit == column.unit:
            hint = "Rename the one that is not meant, or leave it out"
            raise BadInput("bench", f"have one column of {column.quantity}", f"{other.name} and {name}", hint=hint)
        if other is None or column.unit == _OURS.get(column.quantity):
            columns[column.quantity] = column
    return columns


def _column(name: str) -> BenchColumn | None:
    """The quantity and the unit that a title names; None where it is none of a bench."""
    words, unit = _split(name)
    if not _NOT_THESE.isdisjoint(words):
        return None
    for quantity, known in _WORDS_OF.items():
        if known.isdisjoint(words):
            continue
        if not unit and "rpm" in words:
            unit = "rpm"
        unit = {"g": "gf"}.get(unit, unit) if quantity == "thrust" else unit
        if quantity == "command":
            quantity = {"us": "pulse", "V": "voltage", "%": "duty"}.get(unit, quantity)
        return BenchColumn(name, quantity, unit)
    return None


def _split(name: str) -> tuple[list[str], str]:
    """Words and unit of a title: the unit stands in brackets, or is one of the words after the first."""
    in_brackets = re.search(r"[(\[]([^)\]]*)[)\]]", name)
    outside = re.sub(r"[(\[][^)\]]*[)\]]", " ", name).lower()
    if in_brackets:
        return re.findall(r"[a-z]+", outside), _unit(in_brackets[1])
    outside = outside.replace("rad_s", "rad/s")
    words = [word for word in re.split(r"[\s_\-.]+", outside) if word]
    units = [_unit(word) for word in words[1:]]
    return words, next((unit for unit in units if unit in UNITS or unit in TIMES), "")


def _unit(spelled: str) -> str:
    compact = re.sub(r"\s", "", spelled).lower()
    return _SPELLINGS.get(compact, compact)
