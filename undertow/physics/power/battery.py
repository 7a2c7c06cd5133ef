"""A battery: open-circuit voltage that falls with the charge drawn, behind an internal resistance."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.param import Param, param

Scalar = Float[Array, ""]
Values = Float[Array, "*#n"]  # one, or one for each instant

_HALVINGS = 30  # of the interval in which the voltage limit is sought: 20 V / 2^30 is 20 nV
_KNEE = 1e-12  # share of E^2; keeps the gradient finite at the largest power


class Battery(eqx.Module):
    """E(q) in series with R, feeding lossless converters. Its state is the charge drawn q, C (A s).

    The converters take a power P at any voltage: v^2 - E v + R P = 0 for the voltage v of the bus. The largest power
    is E^2 / (4 R). An empty battery is not cut off: its voltage continues to fall along the same line.

    Raises:
        BadInput: a value that is not positive (resistance: negative), or the empty voltage above the full one.
    """

    full_voltage: Float[Param, ""] = param("V", "open-circuit voltage when full", symbol="E_1")
    empty_voltage: Float[Param, ""] = param("V", "open-circuit voltage when empty", symbol="E_0")
    resistance: Float[Param, ""] = param("ohm", "internal resistance, leads included", symbol="R")
    capacity: Float[Param, ""] = param("A h", "charge from full to empty", symbol="Q")

    def __check_init__(self):
        for name in ("full_voltage", "empty_voltage", "capacity"):
            checks.positive(name, getattr(self, name))
        checks.not_negative("resistance", self.resistance, "ohm")
        if not checks.assumed(lambda empty, full: (empty <= full).all(), self.empty_voltage, self.full_voltage):
            must = f"be at most the full voltage ({float(self.full_voltage):g} V)"
            raise BadInput("empty_voltage", must, f"{float(self.empty_voltage):g} V")

    def state_of_charge(self, charge: Values) -> Values:
        """1 when full, 0 when empty."""
        return 1 - charge / (3600 * self.capacity)

    def open_circuit_voltage(self, charge: Values) -> Values:
        """E, V, linear in the state of charge."""
        return self.empty_voltage + (self.full_voltage - self.empty_voltage) * self.state_of_charge(charge)

    def bus_voltage(self, charge: Values, power: Values) -> Values:
        """v, V, while the converters take a power in W: the larger root; E / 2 from E^2 / (4 R) on."""
        emf = self.open_circuit_voltage(charge)
        under_root = emf**2 - 4 * self.resistance * power
        return (emf + jnp.sqrt(jnp.maximum(under_root, _KNEE * emf**2))) / 2

    def current(self, charge: Values, power: Values) -> Values:
        """dq/dt = P / v, A."""
        return power / self.bus_voltage(charge, power)

    def loss(self, charge: Values, power: Values) -> Values:
        """Heat in the battery, W: E i - P, which is R i^2 up to the largest power."""
        return self.open_circuit_voltage(charge) * self.current(charge, power) - power

    def energy(self, charge: Values) -> Values:
        """Energy that the cells have given with a charge: the integral of E dq, J."""
        return charge * (self.full_voltage + self.open_circuit_voltage(charge)) / 2

    def allows(self, charge: Values, voltage: Values, power: Values) -> Array:
        """Whether a power, in W, leaves at least this voltage on the bus."""
        emf = self.open_circuit_voltage(charge)
        lowest = jnp.maximum(voltage, emf / 2)
        return self.resistance * power <= lowest * (emf - lowest)

    def limit(self, charge: Scalar, power_at: Callable[[Scalar], Scalar], top: Scalar) -> Scalar:
        """Largest voltage up to `top` that the battery can give to loads of power_at(voltage).

        Found by bisection, rounded down, because load and bus voltage depend on each other.
        """

        def possible(voltage):
            return self.allows(charge, voltage, power_at(voltage))

        def halve(_, bounds):
            low, high = bounds
            middle = (low + high) / 2
            good = possible(middle)
            return jnp.where(good, middle, low), jnp.where(good, high, middle)

        low, _ = jax.lax.fori_loop(0, _HALVINGS, halve, (jnp.zeros_like(top), top))
        return jnp.where(possible(top), top, low)


def battery(
    full_voltage: float = 16.8, empty_voltage: float = 13.2, resistance: float = 0.02, capacity: float = 18.0
) -> Battery:
    """A lithium battery of four cells in series (4.2 V to 3.3 V each), 18 A h, as usual for a small vehicle.

    Args:
        full_voltage: open-circuit voltage when full, V.
        empty_voltage: open-circuit voltage when empty, V; linear in between.
        resistance: internal resistance with leads, ohm; 20 mohm is an assumption, not from a data sheet.
        capacity: charge from full to empty, A h.
    """
    return Battery(full_voltage, empty_voltage, resistance, capacity)
