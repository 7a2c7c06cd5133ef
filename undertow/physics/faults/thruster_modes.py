"""Modes of thrusters and of their supply."""

import jax.numpy as jnp

from undertow.physics.faults.mode import AbstractThrustMode, Moment, Severity, Signal, signal_mode


class Fraction(AbstractThrustMode):
    """A share of the thrust is left; voltage, current and speed of the motor are those of a thruster without fault."""

    severity = Severity("share of the thrust that is left", "", 0.5, -1.0, 1.0)

    def factor(self, severity):
        return severity


def fraction() -> Fraction:
    """A damaged propeller: a share of the thrust is left."""
    return Fraction()


@signal_mode(("thruster",), Severity("threshold as a share of the largest input", "", 0.3, 0.0, 1.0))
def dead_zone(moment: Moment, value: Signal) -> Signal:
    """Inputs smaller than the severity have no effect."""
    return jnp.where(jnp.abs(value) < moment.severity, jnp.zeros_like(value), value)


@signal_mode(
    ("thruster", "bus"), Severity("largest positive input that is left, as a share of the largest", "", 0.0, 0.0, 1.0)
)
def one_sided(moment: Moment, value: Signal) -> Signal:
    """Positive inputs are limited, negative ones are not, as with half of a bridge that has failed."""
    return jnp.minimum(value, moment.severity)


@signal_mode(("thruster",))
def reversed(moment: Moment, value: Signal) -> Signal:
    """The input acts with the other sign, as after two phases of a motor were exchanged."""
    return -value


@signal_mode(("thruster",), Severity("input as a share of the largest, negative for reverse", "", 1.0, -1.0, 1.0))
def runaway(moment: Moment, value: Signal) -> Signal:
    """Full thrust, or another constant one, whatever is commanded."""
    return jnp.full_like(value, 1.0) * moment.severity


@signal_mode(("bus",), Severity("lost share of the largest input", "", 0.4, 0.0, 1.0))
def sag(moment: Moment, value: Signal) -> Signal:
    """Inputs of all thrusters are limited to a smaller range, as by a supply that has lost voltage."""
    return jnp.clip(value, moment.severity - 1, 1 - moment.severity)


PARTS = (fraction, dead_zone, one_sided, reversed, runaway, sag)
