"""The energy ledger: the energy balance of the thrusters, integrated along the run with the plant.

Two numbers show whether it closes.

    residual  source + conversion - copper - friction - water - stored, all integrated. The rates cancel at every
              instant, so the residual is rounding if the equations conserve energy.
    defect    the same with the present energy of windings and rotors (and, with a battery, the energy that its cells
              have lost) in place of the integrals: it includes the error of the integrator, which falls with the step.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Joule = Float[Array, ""]
JoulePerThruster = Float[Array, "*N"]

_HAIR = 1e-9  # s; times of records are multiples of a step in floating point


class Ledger(NamedTuple):
    """Energies since the start, J; as rates, W. One entry per thruster, which costs less than summing at every step."""

    source: JoulePerThruster  # taken from the bus by the drives: V I
    copper: JoulePerThruster  # R I^2 of the windings
    friction: JoulePerThruster  # k_f Om^2
    water: JoulePerThruster  # Q Om, given to the water
    conversion: JoulePerThruster  # (k_t - k_e) I Om: created energy unless k_t = k_e
    stored: JoulePerThruster  # stored in windings and rotors
    battery: Joule  # heat in the battery

    def total(self) -> "Ledger":
        """All thrusters together."""
        return jax.tree.map(jnp.sum, self)

    def residual(self) -> JoulePerThruster:
        """Residual of the integrated columns, J."""
        return self.source + self.conversion - self.spent() - self.stored

    def defect(self, stored: JoulePerThruster, cells: Joule | None) -> JoulePerThruster:
        """Residual against the state itself, J: present stored energy, and energy that left the cells."""
        supplied = self.source if cells is None else cells - self.battery
        return supplied + self.conversion - self.spent() - stored

    def spent(self) -> JoulePerThruster:
        """Copper, friction and water, J."""
        return self.copper + self.friction + self.water


# Column of a result file -> meaning; all in J.
COLUMNS = {
    "energy_source": "energy that the drives took from the bus",
    "energy_copper": "heat in the windings",
    "energy_friction": "heat in bearings and seals",
    "energy_water": "work of the propellers on the water",
    "energy_conversion": "created energy: (k_t - k_e) I Om, and what fidelity `ideal` neglects",
    "energy_stored": "energy stored in windings and rotors",
    "energy_battery": "heat in the battery",
    "energy_residual": "residual of these: rounding where the equations conserve energy",
    "energy_integration_error": "residual against the state itself: error of the integrator",
}


def opened(thrusters: int) -> Ledger:
    """An empty ledger for a number of thrusters."""
    return Ledger(*[jnp.zeros(thrusters)] * (len(Ledger._fields) - 1), battery=jnp.zeros(()))


def columns(ledger: Ledger, stored: Joule, cells: Joule | None) -> dict[str, Joule]:
    """Entries of COLUMNS at one instant, of all thrusters together."""
    total = ledger.total()
    kept = {f"energy_{name}": value for name, value in total._asdict().items()}
    return kept | {"energy_residual": total.residual(), "energy_integration_error": total.defect(stored, cells)}


def closure(recorded: Mapping[Any, Any], start: float = 0.0, stop: float = math.inf) -> dict[str, float]:
    """How well the energy balance of a recorded run closes between two times, s; {} without a ledger.

    Returns:
        Largest change of the residual and of the integration error since the start, as shares of the energy supplied
        until the stop.
    """
    if "energy_source" not in recorded:
        return {}
    time = np.asarray(recorded["time"])
    inside = (time >= start - _HAIR) & (time <= stop + _HAIR)

    def change(name: str) -> np.ndarray:
        values = np.asarray(recorded[f"energy_{name}"])[inside]
        return np.abs(values - values[:1])

    supplied = change("source")[-1:].sum()
    share = lambda name: float(change(name).max() / supplied) if supplied else 0.0
    return {"energy_balance_residual": share("residual"), "energy_integration_residual": share("integration_error")}
