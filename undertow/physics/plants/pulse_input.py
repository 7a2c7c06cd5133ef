"""Vehicles whose thrusters are driven by servo pulses, as those of autopilots."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import Inputs
from undertow.core.errors import BadInput
from undertow.physics.plants.hybrid_vehicle import HybridVehicle, VehicleState
from undertow.physics.power.esc import ESC


def pulse_driven(plant: Any, battery_suffices: bool) -> HybridVehicle:
    """The plant, if speed controllers can drive its thrusters.

    Args:
        plant: of a scenario.
        battery_suffices: whether the voltage of the bus may be that of a battery.

    Raises:
        BadInput: it is no vehicle with thrusters, they are not commanded in volts, or the voltage is unknown.
    """
    if not isinstance(plant, HybridVehicle):
        raise BadInput("plant", "be a vehicle with thrusters", type(plant).__name__)
    if plant.thruster.input_unit != "V":
        hint = "Take thrusters commanded in volts, such as t200"
        raise BadInput("plant.thruster", "take volts, as speed controllers give", plant.thruster.input_unit, hint=hint)
    powered = battery_suffices and plant.power.battery is not None
    if not powered and not np.isfinite(np.asarray(plant.thruster.supply)).all():
        hint = f"Give the thruster a supply{', or the vehicle a battery' if battery_suffices else ''}"
        raise BadInput("plant.thruster.supply", "be finite for speed controllers", "infinite", hint=hint)
    return plant


def applied_voltage(plant: HybridVehicle, speed_controllers: ESC, x: VehicleState, pulses: Inputs) -> Inputs:
    """Voltages, V, at which speed controllers drive the thrusters.

    With a battery, the voltage of the bus is the one that its load leaves: the load follows from the voltage, and so
    the largest voltage is sought that the battery can give.
    """
    thruster, battery = plant.thruster, plant.power.battery
    if battery is None:
        bus = jnp.asarray(thruster.supply)
    else:
        load = lambda bus: thruster.electrical_power(x.thrusters, speed_controllers.voltage(pulses, bus)).sum()
        bus = battery.limit(x.power.charge, load, battery.open_circuit_voltage(x.power.charge))
    return jnp.clip(speed_controllers.voltage(pulses, bus), *thruster.limits())
