"""Quantities in plain text, in the units that people use for their size."""

import math

# Errors below these are of no account to a vehicle: 1 mm, and a hundredth of a degree.
LEAST = {"m": 1e-3, "rad": math.radians(0.01)}
# Factor of each prefix, from large to small.
_PREFIXED = {
    "m": ((1e3, "km"), (1.0, "m"), (1e-2, "cm"), (1e-3, "mm")),
    "J": ((1e6, "MJ"), (1e3, "kJ")),
    "W": ((1e3, "kW"),),
}


def quantity(value: float, unit: str) -> str:
    """A value in the unit that people use for one of its size, with two or three digits.

    Shares, whose unit is ``, are in percent, and what has the unit 1 is a plain number.
    """
    least = LEAST.get(unit)
    if least is not None and abs(value) < least:
        return f"less than {quantity(least, unit)}"
    if unit == "rad":
        degrees = _digits(math.degrees(value))
        return f"{degrees} degree{'' if degrees == '1' else 's'}"
    if unit == "s":
        return f"{value:.3g} s"
    if unit == "":
        return f"{_digits(100 * value)} %"
    for factor, prefixed in _PREFIXED.get(unit, ()):
        if abs(value) >= factor:
            return f"{_digits(value / factor)} {prefixed}"
    return f"{_digits(value)} {unit}".removesuffix(" 1")


def _digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}" if abs(value) < 100 else f"{value:.0f}"
