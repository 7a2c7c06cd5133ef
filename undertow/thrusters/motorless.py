"""Thrusters behind whose thrust no motor is known."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.thrusters.thruster import AbstractThruster, PerThruster


class AbstractMotorlessThruster(AbstractThruster):
    """No books to keep, no speed to report, and a gain that is given because it does not follow from anything."""

    linear_gain: eqx.AbstractVar[Float[Array, ""]]  # N/V

    def powers(self, state, voltage) -> None:
        return None

    def stored(self, state) -> PerThruster:
        return jnp.zeros(())

    def report(self, state) -> None:
        return None

    def voltage_gain(self):
        return self.linear_gain
