"""Modes of thrusters and of their supply."""

import jax.numpy as jnp

from undertow.physics.faults.mode import NO_SEVERITY, AbstractMode, AbstractThrustMode, Altered, Severity


class Fraction(AbstractThrustMode):
    """A share of the thrust is left; voltage, current and speed of the motor are those of a thruster without fault."""

    targets = ("thruster",)
    severity = Severity("share of the thrust that is left", "", 0.5, -1.0, 1.0)

    def factor(self, severity):
        return severity


def fraction() -> Fraction:
    """A damaged propeller: a share of the thrust is left."""
    return Fraction()


class DeadZone(AbstractMode):
    """Inputs below a threshold have no effect."""

    targets = ("thruster",)
    severity = Severity("threshold as a share of the largest input", "", 0.3, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(
            jnp.where(jnp.abs(value) < moment.severity, jnp.zeros_like(value), value), jnp.asarray(True)
        ), memory


def dead_zone() -> DeadZone:
    """Inputs smaller than the severity have no effect."""
    return DeadZone()


class OneSided(AbstractMode):
    """Positive inputs are limited to less than negative ones."""

    targets = ("thruster", "bus")
    severity = Severity("largest positive input that is left, as a share of the largest", "", 0.0, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.minimum(value, moment.severity), jnp.asarray(True)), memory


def one_sided() -> OneSided:
    """Positive inputs are limited, negative ones are not, as with half of a bridge that has failed."""
    return OneSided()


class Reversed(AbstractMode):
    """The sign of the input is wrong."""

    targets = ("thruster",)
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(-value, jnp.asarray(True)), memory


def reversed() -> Reversed:
    """The input acts with the other sign, as after two phases of a motor were exchanged."""
    return Reversed()


class Runaway(AbstractMode):
    """A constant input, whatever is commanded."""

    targets = ("thruster",)
    severity = Severity("input as a share of the largest, negative for reverse", "", 1.0, -1.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.full_like(value, 1.0) * moment.severity, jnp.asarray(True)), memory


def runaway() -> Runaway:
    """Full thrust, or another constant one, whatever is commanded."""
    return Runaway()


class Sag(AbstractMode):
    """All inputs are limited to a smaller range."""

    targets = ("bus",)
    severity = Severity("lost share of the largest input", "", 0.4, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.clip(value, moment.severity - 1, 1 - moment.severity), jnp.asarray(True)), memory


def sag() -> Sag:
    """Inputs of all thrusters are limited to a smaller range, as by a supply that has lost voltage."""
    return Sag()


PARTS = (fraction, dead_zone, one_sided, reversed, runaway, sag)
