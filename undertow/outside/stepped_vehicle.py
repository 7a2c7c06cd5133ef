"""The vehicle of a scenario by itself, stepped by other people's software: pulses in, motion out."""

import dataclasses
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core import runtime
from undertow.core.arrays import as_array
from undertow.core.contracts import Inputs
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.status import Status
from undertow.outside.autopilot.vehicle import Vehicle
from undertow.physics.disturbances.surface import UnderSurface, stated_depths, surface
from undertow.physics.plants.hybrid_vehicle import HybridVehicle, VehicleState
from undertow.physics.plants.pulse_input import pulse_driven
from undertow.physics.power.esc import esc
from undertow.scenario.build import build
from undertow.scenario.reading import read
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.stepped import compile_step, copy_into

# Gravity that ArduPilot and PX4 subtract from what accelerometers measure, m/s^2.
STANDARD_GRAVITY = 9.80665


class VehicleOutputs(NamedTuple):
    """Motion of a vehicle and its electrical side at an instant; NumPy arrays."""

    position: Any  # m, north, east, down
    attitude: Any  # unit quaternion w, x, y, z, body -> world
    velocity: Any  # m/s, north, east, down
    body_velocity: Any  # u, v, w, m/s, and p, q, r, rad/s
    specific_force: Any  # m/s^2, body axes: of an ideal accelerometer at the origin of the body
    propellers: Any  # rad/s; () where the thrusters report none
    battery: Any  # voltage of the bus, V, and current, A; () without a battery


class SteppedVehicle:
    """The vehicle of a scenario behind an autopilot: pulses in, motion and electrical side out, frame by frame.

    It is compiled when it is made.

    Args:
        scenario: a .yaml file or an earlier run.nc.
        allow_code: whether the Python code that an earlier run.nc names may run.
        depth: of the scenario's origin below the surface, m; None for the one that the scenario states (waves do).
        otherwise: the depth, m, where neither states one; None for water without a surface.

    Attributes:
        vehicle: that is stepped.
        plant: of the scenario.
        esc: speed controllers; usual ones where the scenario has none.
        depth: of the scenario's origin below the surface, m; None without a surface.

    Raises:
        BadInput: the scenario is invalid, its plant is no vehicle with thrusters in volts and a supply, or it states
            another depth.
    """

    def __init__(
        self, scenario: str | Path, allow_code: bool = False, depth: float | None = None, otherwise: float | None = None
    ):
        built = build(read(Path(scenario), allow_code=allow_code))
        self.plant = pulse_driven(built.closed_loop.plant, battery_suffices=True)
        loop = _under_surface(built.closed_loop, depth, otherwise)
        self.depth = next(iter(stated_depths(loop.disturbance)), None)
        self.vehicle = Vehicle(built._replace(closed_loop=loop), attitude="quaternion", command="pulses")
        self.esc = self.vehicle.esc or esc()
        with runtime.on_processor(), runtime.in_precision(self.vehicle.precision):
            zero, none = jnp.zeros(()), jnp.zeros(self.plant.inputs())

            def look(part: Realization, _, arguments: tuple[Any, VehicleState, Inputs]):
                return (), _state_of(part, *arguments)

            realization, x = self.vehicle.realization, self.vehicle.state
            self._look = compile_step(look, realization, (), (zero, x, none))

    def restart(self) -> None:
        """Go back to the start of the scenario: the same state, and the same disturbances."""
        self.vehicle.restart()

    @property
    def time(self) -> float:
        """s since the start."""
        return self.vehicle.time

    def step(self, pulses: Any, dt: float) -> bool:
        """Hold pulses for a time.

        Args:
            pulses: one per thruster, us.
            dt: s.

        Returns:
            Whether the vehicle goes on. If not, its state is not finite or beyond any vehicle; the last valid one is
            kept.

        Raises:
            BadInput: not one pulse for each thruster.
        """
        self.vehicle.step(pulses, dt)
        return self.vehicle.going_on

    @property
    def status(self) -> Status:
        """Status of the last step."""
        return self.vehicle.output.status

    def state(self) -> VehicleOutputs:
        """Motion and electrical side now, with the last input still applied."""
        applied = self.vehicle.output.applied
        zero_input = np.zeros(self.plant.inputs())
        copy_into(self._look.inputs, (self.time, self.vehicle.state, zero_input if applied is None else applied))
        self._look()
        return jax.tree.map(np.array, self._look.outputs)


def _under_surface(loop: ClosedLoop, depth: float | None, otherwise: float | None) -> ClosedLoop:
    """The loop with the surface where `SteppedVehicle` says."""
    stated = stated_depths(loop.disturbance)
    if depth is not None and stated and stated[0] != depth:
        hint = "Leave one of them out: the surface of waves is `depth` of the waves above the world's origin"
        raise BadInput("depth", f"be that of the scenario's disturbance, {stated[0]:g} m", f"{depth:g} m", hint=hint)
    depth_of_surface = otherwise if depth is None else depth
    if stated or depth_of_surface is None:
        return loop
    return dataclasses.replace(loop, disturbance=UnderSurface(loop.disturbance, surface(depth_of_surface)))


def _state_of(realization: Realization, t, x: VehicleState, u: Inputs) -> VehicleOutputs:
    plant = realization.loop.plant
    assert isinstance(plant, HybridVehicle)
    pose = plant.pose(x)
    acceleration = plant.acceleration(t, x, u, realization.load(t, x))[:3]
    force = matvec(pose.rotation.T, acceleration - as_array((0.0, 0.0, STANDARD_GRAVITY)))
    report = plant.thruster.report(x.thrusters)
    battery = plant.power.battery
    electrical = ()
    if battery is not None:
        power = plant.thruster.electrical_power(x.thrusters, u).sum()
        charge = x.power.charge
        electrical = jnp.stack([battery.bus_voltage(charge, power), battery.current(charge, power)])
    propellers = () if report is None else report.speed
    return VehicleOutputs(x.position, x.attitude, pose.velocity, x.nu, force, propellers, electrical)
