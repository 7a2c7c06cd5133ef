"""From the volts of a law to messages for the autopilot, through the speed controllers of the scenario."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from undertow.core import runtime
from undertow.core.contracts import Inputs
from undertow.outside.autopilot.autopilot import Autopilot
from undertow.outside.mavlink.actuator_commands import MavlinkTarget, Pulses, commands_of
from undertow.outside.thruster_channels import channels_of_vehicle
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.plants.pulse_input import pulse_driven
from undertow.physics.power.esc import ESC, esc
from undertow.simulation.loop.stepped import compile_step


class ThrusterDriver:
    """Makes the commands to the thrusters of a vehicle.

    Args:
        autopilot: whose vehicle it is.
        output: what the commands are, see `actuator_commands`.
        target: to whom they go.
        frame, channels: of the thrusters, see `thruster_channels`.

    Attributes:
        channels: of the thrusters.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(
        self, autopilot: Autopilot, output: str, target: MavlinkTarget, frame: str | None, channels: str | None
    ):
        plant = pulse_driven(autopilot.plant, battery_suffices=False)
        self._esc = plant.power.esc or esc()
        self._target = target
        self.channels = channels_of_vehicle(np.asarray(plant.thruster_matrix), frame, channels)
        self._commands = commands_of(output, int(self.channels.numbers.max()))
        with runtime.on_processor(), runtime.in_precision(autopilot.precision):
            self._drive = compile_step(driven, (plant, self._esc), (), jnp.zeros(plant.inputs()))

    def commands(self, volts: np.ndarray, time_usec: int) -> list[Any]:
        """Commands for the volts of a law; `time_usec` is that of the odometry which they answer."""
        self._drive.inputs[...] = volts
        self._drive()
        return self._made(self._drive.outputs[0], time_usec)

    def neutral(self) -> list[Any]:
        """Commands that stop all thrusters."""
        return self._made(np.full(len(self.channels.numbers), float(self._esc.neutral)), 0)

    @property
    def applied(self) -> np.ndarray:
        """Volts that the pulses of the last command give."""
        return self._drive.outputs[1].copy()

    def _made(self, pulses: Any, time_usec: int) -> list[Any]:
        neutral, span = float(self._esc.neutral), float(self._esc.span)
        by_channel = self.channels.of_outputs(pulses, neutral)
        return self._commands(self._target, Pulses(by_channel, neutral, span), time_usec)


def driven(of: tuple[HybridVehicle, ESC], _, volts: Inputs):
    """Pulses, us, for the volts of a law, and the volts that these give, which the law gets as applied."""
    plant, speed_controllers = of
    bus = jnp.asarray(plant.thruster.supply)
    pulses = speed_controllers.pulse(jnp.clip(volts, *plant.thruster.limits()), bus)
    return (), (pulses, speed_controllers.voltage(pulses, bus))
