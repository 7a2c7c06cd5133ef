"""The controller of a scenario, compiled for a node of ROS 2."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp
from numpy.typing import NDArray

from undertow.core import checks, runtime
from undertow.outside.autopilot.autopilot import Autopilot
from undertow.outside.autopilot.output import Output, output_of
from undertow.outside.ros2.checked_scenario import check_vehicle
from undertow.outside.ros2.from_messages import thruster_label
from undertow.scenario.build import build
from undertow.scenario.link_scenario import at_sampling_time, read_for_link
from undertow.simulation.loop.stepped import compile_step, copy_into


class CompiledController:
    """The controller of a scenario, compiled, with its output.

    Commands are limited to what the thrusters can give, so that the law adapts to what is applied; a battery counts as
    full.

    Args:
        scenario: a .yaml file or an earlier run.nc, of a vehicle.
        output: `input`, `newtons` or `pulses` (one number per thruster), or `wrench`.
        rate: control steps per second; None for the scenario's.
        unsupervised: whether there is no supervisor where the scenario has none.
        allow_code: whether the Python code that an earlier run.nc names may run.

    Attributes:
        autopilot: it gives inputs.
        output: as given.
        thrusters: how many.
        label: of an array of outputs.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(
        self,
        scenario: Path,
        output: str = "input",
        rate: float | None = None,
        *,
        unsupervised: bool = False,
        allow_code: bool = False,
    ):
        if rate is not None:
            checks.positive("rate", rate, "Hz")
        text = read_for_link(scenario, allow_code=allow_code, unsupervised=unsupervised)
        text = at_sampling_time(text, None if rate is None else 1 / rate)
        built = build(text)
        check_vehicle(built)
        plant, law = built.closed_loop.plant, built.closed_loop.controller
        self.autopilot = Autopilot(text, attitude="quaternion", velocity="body", log_later=True)
        self.output = output
        self.thrusters = plant.inputs()
        with runtime.on_processor(), runtime.in_precision(built.scenario.precision):
            conversion = output_of(output, plant, law, None)
            self.label = thruster_label(conversion.unit)
            self._conversion = compile_step(_limited, conversion, (), jnp.zeros(self.thrusters))

    def limited(self, u: NDArray) -> tuple[NDArray, NDArray]:
        """An input as far as the thrusters can give it, and the same as output."""
        copy_into(self._conversion.inputs, u)
        self._conversion()
        applied, values = self._conversion.outputs
        return applied.copy(), values.copy()


def _limited(output: Output, _: Any, u: Any):
    applied = output.plant.admissible(output.plant.initial_state(), u)
    return (), (applied, output.of(applied))
