"""The energy ledger: where every joule came from and went, integrated along the run beside the plant.

Two numbers say whether it closes.

    books   source + conversion - copper - friction - water - stored, all of them integrated. The rates cancel at every
            instant, so what is left is rounding: it says that the equations conserve energy.
    defect  the same with the energy that is in windings and rotors at that instant (and, with a battery, the energy
            that its cells have lost) in place of the integrals: it holds the error of the integrator as well, which
            falls with the step.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

Joule = Float[Array, ""]


class Ledger(NamedTuple):
    """Energies of all thrusters together since the start, J; as rates, W."""

    source: Joule  # taken from the bus by the drives: V I
    copper: Joule  # R I^2 of the windings
    friction: Joule  # k_f Om^2
    water: Joule  # Q Om, given to the water
    conversion: Joule  # (k_t - k_e) I Om: out of nothing, unless k_t = k_e
    stored: Joule  # gone into windings and rotors
    battery: Joule  # heat in the battery

    def books(self) -> Joule:
        """What the integrated columns leave over, J."""
        return self.source + self.conversion - self.spent() - self.stored

    def defect(self, stored: Joule, cells: Joule | None) -> Joule:
        """What is left over against the state itself, J: stored energy now, and energy that left the cells."""
        drawn = self.source if cells is None else cells - self.battery
        return drawn + self.conversion - self.spent() - stored

    def spent(self) -> Joule:
        """Copper, friction and water, J."""
        return self.copper + self.friction + self.water


# Column of a result file -> meaning; all in J.
COLUMNS = {
    "energy_source": "energy that the drives took from the bus",
    "energy_copper": "heat in the windings",
    "energy_friction": "heat in bearings and seals",
    "energy_water": "work of the propellers on the water",
    "energy_conversion": "energy out of nothing: (k_t - k_e) I Om, and what rung `ideal` leaves out",
    "energy_stored": "energy gone into windings and rotors",
    "energy_battery": "heat in the battery",
    "energy_books": "what these leave over: rounding, where the equations conserve energy",
    "energy_defect": "what is left over against the state itself: error of the integrator",
}


def opened() -> Ledger:
    """An empty ledger."""
    return Ledger(*[jnp.zeros(())] * len(Ledger._fields))


def columns(ledger: Ledger, stored: Joule, cells: Joule | None) -> dict[str, Joule]:
    """Entries of COLUMNS at one instant."""
    kept = {f"energy_{name}": value for name, value in ledger._asdict().items()}
    return kept | {"energy_books": ledger.books(), "energy_defect": ledger.defect(stored, cells)}


def closure(recorded: Mapping[Any, Any]) -> dict[str, float]:
    """Largest |books| and |defect| of a recorded run, as shares of the energy drawn by its end; {} without a ledger."""
    if "energy_source" not in recorded:
        return {}
    drawn = abs(float(recorded["energy_source"][-1]))
    share = lambda name: float(abs(recorded[name]).max()) / drawn if drawn > 0 else 0.0
    return {"energy_books_share": share("energy_books"), "energy_defect_share": share("energy_defect")}
