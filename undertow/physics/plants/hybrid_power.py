"""The electrical side of a vehicle: battery, speed controllers and energy ledger, each of them optional."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.kept_programs import kept_result
from undertow.core.signals import Signal
from undertow.physics.power import ledger as diagnostics
from undertow.physics.power.battery import Battery
from undertow.physics.power.esc import ESC
from undertow.physics.thrusters.thruster import AbstractThruster

Scalar = Float[Array, ""]

_AT_LIMIT = 0.005  # share of the largest voltage within which a thruster counts as saturated: two steps of a pulse
_ROUNDING = 1e-6  # relative rounding of a limited voltage in single precision


class PowerState(NamedTuple):
    """State of the electrical side; None for an absent part."""

    charge: Any = None  # charge drawn from the battery, C
    ledger: Any = None  # J, a Ledger


class HybridPower(eqx.Module):
    """Map from commanded to applied voltages. The voltage is held over a sampling time.

    Raises:
        BadInput: speed controllers without a bus voltage, or a ledger for thrusters without a motor.
    """

    battery: Battery | None
    esc: ESC | None
    ledger: bool = eqx.field(static=True)

    def check(self, thruster: AbstractThruster) -> None:
        """Check that it fits these thrusters."""
        for name, kind in (("battery", Battery), ("esc", ESC)):
            part = getattr(self, name)
            if part is not None and not isinstance(part, kind):
                raise BadInput(name, f"be a {kind.__name__}", type(part).__name__)
            if part is not None and thruster.input_unit != "V":
                hint = "A battery and speed controllers need thrusters commanded in volts, such as t200"
                raise BadInput(name, f"be left out with a thruster commanded in {thruster.input_unit}", hint=hint)
        finite = lambda volts: (abs(volts) < np.inf).all()
        if self.esc is not None and self.battery is None and not checks.assumed(finite, thruster.supply):
            hint = "Give the thruster a supply, or the vehicle a battery"
            raise BadInput("esc", "have a finite bus voltage", "on an infinite supply", hint=hint)
        if self.ledger and not has_motor(thruster):
            hint = "This thruster has no model of its motor, so its energies are unknown"
            raise BadInput("ledger", "be false", "true", hint=hint)

    def initial_state(self, thrusters: int) -> PowerState:
        """Full battery, empty ledger."""
        charge = None if self.battery is None else jnp.zeros(())
        return PowerState(charge, diagnostics.opened(thrusters) if self.ledger else None)

    def dynamics(self, thruster: AbstractThruster, state: Any, rates: Any, power: PowerState, u) -> PowerState:
        """Rates of the electrical state, from those of the thrusters."""
        taken = thruster.electrical_power(state, u).sum()
        current = loss = None
        if self.battery is not None:
            current, loss = self.battery.current(power.charge, taken), self.battery.loss(power.charge, taken)
        flows = thruster.powers(state, u) if self.ledger else None
        if flows is None:
            return PowerState(current)
        _, into_store = jax.jvp(thruster.stored, (state,), (rates,))
        heat = jnp.zeros(()) if loss is None else loss
        rows = diagnostics.Ledger(*flows, stored=jnp.broadcast_to(into_store, u.shape), battery=heat)
        return PowerState(current, rows)

    def admissible(self, thruster: AbstractThruster, state: Any, power: PowerState, u):
        """Voltages limited by the supply and the battery, rounded to pulses of the speed controllers."""
        command, limited = jnp.clip(u, *thruster.limits()), False
        if self.battery is not None:
            within = lambda voltage: jnp.clip(command, -voltage, voltage)
            taken = lambda voltage: thruster.electrical_power(state, within(voltage)).sum()
            most = self.battery.limit(power.charge, taken, jnp.abs(command).max())
            command, limited = within(most), most < jnp.abs(command).max()
        if self.esc is not None:
            bus = self.bus_voltage(thruster, state, power, command)
            command = self.esc.voltage(self.esc.pulse(command, bus, limited), bus)
        return command

    def saturated(self, thruster: AbstractThruster, state: Any, power: PowerState, u):
        """True where an applied voltage is at the limit of the supply or of the battery."""
        low, high = thruster.limits()
        limited = (u <= low + _ROUNDING * jnp.abs(low)) | (u >= high - _ROUNDING * jnp.abs(high))
        if self.battery is None:
            return limited
        top, more = jnp.abs(u).max(), (1 + _AT_LIMIT) * u
        spare = self.battery.allows(power.charge, jnp.abs(more).max(), thruster.electrical_power(state, more).sum())
        return limited | ((jnp.abs(u) >= (1 - _AT_LIMIT) * top) & ~spare)

    def bus_voltage(self, thruster: AbstractThruster, state: Any, power: PowerState, u) -> Scalar:
        """Voltage of the bus, V, with u applied to the thrusters."""
        if self.battery is None:
            return thruster.supply
        return self.battery.bus_voltage(power.charge, thruster.electrical_power(state, u).sum())

    def diagnostics(self, thruster: AbstractThruster, state: Any, power: PowerState, u) -> dict[str, Scalar]:
        """Values of `signals`, by name."""
        found, cells = {}, None
        if self.battery is not None:
            cells = self.battery.energy(power.charge)
            found["bus_voltage"] = self.bus_voltage(thruster, state, power, u)
            found["charge_drawn"] = power.charge
            found["state_of_charge"] = self.battery.state_of_charge(power.charge)
        if self.ledger:
            found |= diagnostics.columns(power.ledger, thruster.stored(state).sum(), cells)
        return found

    def signals(self) -> dict[str, Signal]:
        """Declarations of `diagnostics`."""
        battery = {
            "bus_voltage": Signal((), "V", "voltage of the bus under load"),
            "charge_drawn": Signal((), "C", "charge drawn from the battery"),
            "state_of_charge": Signal((), "1", "1 when the battery is full, 0 when empty"),
        }
        energies = {name: Signal((), "J", meaning) for name, meaning in diagnostics.COLUMNS.items()}
        return (battery if self.battery is not None else {}) | (energies if self.ledger else {})


def has_motor(thruster: AbstractThruster) -> bool:
    """Whether the thruster models its motor, so that a ledger can be kept; traced, not computed."""
    powers = lambda: jax.eval_shape(lambda: thruster.powers(thruster.initial_state(1), jnp.zeros(1)))
    return kept_result("has_motor", thruster, lambda: powers() is not None)
