"""A thruster that gives less thrust than it should."""

from undertow.faults.mode import AbstractThrustMode, Severity


class Fraction(AbstractThrustMode):
    """A share of the thrust is left; voltage, current and speed of the motor are those of a thruster without fault."""

    targets = ("thruster",)
    severity = Severity("share of the thrust that is left", "", 0.5, -1.0, 1.0)

    def factor(self, severity):
        return severity


def fraction() -> Fraction:
    """A damaged propeller: a share of the thrust is left."""
    return Fraction()
