"""The vehicle of a scenario by itself, stepped by other people's software: pulses in, motion out."""

import dataclasses
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.autopilot.numbers import numbers, step_of
from undertow.core import runtime
from undertow.core.arrays import as_array
from undertow.core.contracts import Inputs
from undertow.core.errors import BadInput
from undertow.core.expected_measurement import all_finite
from undertow.core.status import Status
from undertow.disturbances.surface import UnderSurface, stated_depths, surface
from undertow.interop.pulse_driven import pulse_driven
from undertow.loop.closed_loop import ClosedLoop, Realization
from undertow.loop.stepped import Uncopied, put, realized
from undertow.numerics.integrators import COMPACT_METHODS
from undertow.numerics.linear_algebra import matvec
from undertow.numerics.random_keys import key_of_seed
from undertow.plants.hybrid_vehicle import HybridVehicle, VehicleState
from undertow.power.esc import ESC, esc
from undertow.scenario.build import build
from undertow.scenario.reading import read

# Gravity that ArduPilot and PX4 subtract from what accelerometers measure, m/s^2.
STANDARD_GRAVITY = 9.80665

# A vehicle that stands upright goes on: nothing here needs Euler angles.
_GOING_ON = (Status.OK, Status.PITCH_SINGULAR)


class State(NamedTuple):
    """Motion of a vehicle and its electrical side at an instant; NumPy arrays."""

    position: Any  # m, north, east, down
    attitude: Any  # unit quaternion w, x, y, z, body -> world
    velocity: Any  # m/s, north, east, down
    body_velocity: Any  # u, v, w, m/s, and p, q, r, rad/s
    specific_force: Any  # m/s^2, body axes: of an ideal accelerometer at the origin of the body
    propellers: Any  # rad/s; () where the thrusters report none
    battery: Any  # voltage of the bus, V, and current, A; () without a battery


class _Given(NamedTuple):
    """Inputs of a step of the integrator."""

    t: Any  # s
    h: Any  # s
    applied: Any  # input of the plant


class SteppedVehicle(Uncopied):
    """The plant of a scenario with its disturbances, integrated as `undertow simulate` does it, frame by frame.

    It is compiled when it is made. A step of the length of the scenario's sampling time has the bits of a simulation.
    A longer one is divided into parts that are no longer than those of the scenario.

    Args:
        scenario: a .yaml file or an earlier run.nc.
        allow_code: whether the Python code that an earlier run.nc names may run.
        depth: of the scenario's origin below the surface, m; None for the one that the scenario states (waves do).
        otherwise: the depth, m, where neither states one; None for water without a surface.

    Attributes:
        plant: of the scenario.
        thrusters: how many.
        esc: speed controllers; usual ones where the scenario has none.
        sampling_time: of the scenario, s.
        time: s since the start.
        depth: of the scenario's origin below the surface, m; None without a surface.

    Raises:
        BadInput: the scenario is invalid, its plant is no vehicle with thrusters in volts and a supply, or it states
            another depth.
    """

    def __init__(
        self, scenario: str | Path, allow_code: bool = False, depth: float | None = None, otherwise: float | None = None
    ):
        built = build(read(Path(scenario), allow_code=allow_code))
        settings, plant = built.scenario.loop, pulse_driven(built.closed_loop.plant, battery_suffices=True)
        self.plant, self.esc = plant, plant.power.esc or esc()
        self.thrusters, self.sampling_time = plant.inputs(), float(settings.dt)
        self._longest = self.sampling_time / settings.substeps
        integrate = COMPACT_METHODS.get(settings.method, COMPACT_METHODS["rk4"])
        with runtime.on_processor(), runtime.in_precision(built.scenario.precision):
            loop, key = _under_surface(built.closed_loop, depth, otherwise), key_of_seed(built.scenario.seed)
            self.depth = next(iter(stated_depths(loop.disturbance)), None)
            start = loop.outputs_at_start(*map(_numbers, built.scenario.initial))
            realization, x = _begun(loop, key, start)
            self._compile(realization, x, integrate)
        self.restart()

    def _compile(self, realization: Realization, x: VehicleState, integrate: Any) -> None:
        self._first = jax.tree.map(np.array, x)
        zero, none = jnp.zeros(()), jnp.zeros(self.thrusters)

        def advance(of: Realization, x: VehicleState, given: _Given):
            new = integrate(lambda t, x: of.motion(t, x, given.applied), given.t, x, given.h)
            code = of.loop.plant.status(new)
            going_on = jnp.stack([code == int(status) for status in _GOING_ON]).any() & all_finite(new)
            return jax.tree.map(lambda n, o: jnp.where(going_on, n, o), new, x), (going_on, code)

        def applied(of: tuple[HybridVehicle, ESC], _, given: tuple[VehicleState, Inputs]):
            return (), applied_voltage(*of, *given)

        def look(of: Realization, _, given: tuple[Any, VehicleState, Inputs]):
            return (), _state_of(of, *given)

        self._advance = step_of(advance, realization, x, _Given(zero, zero, none))
        self._apply = step_of(applied, (self.plant, self.esc), (), (x, none))
        self._look = step_of(look, realization, (), (zero, x, none))

    def restart(self) -> None:
        """Go back to the start of the scenario: the same state, and the same disturbances."""
        put(self._advance.state, self._first)
        self._input = np.zeros(self.thrusters)
        self._since, self._frames, self._dt = 0.0, 0, self.sampling_time

    @property
    def time(self) -> float:
        """s since the start; a multiple of the length of a frame where all were alike, as in a simulation."""
        return self._since + self._frames * self._dt

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
        put(self._apply.inputs, (self._advance.state, numbers("pulses", pulses, (self.thrusters,))))
        self._apply()
        return self.hold(self._apply.outputs, dt)

    def hold(self, applied: Any, dt: float) -> bool:
        """As `step`, with the input of the plant in place of pulses: volts."""
        self._input = numbers("applied", applied, (self.thrusters,)).copy()
        parts = max(1, round(np.ceil(dt / self._longest - 1e-6)))
        going_on, given, start = True, self._advance.inputs, self.time
        given.applied[...], given.h[...] = self._input, dt / parts
        for part in range(parts):
            given.t[...] = start + part * (dt / parts)
            self._advance()
            going_on = going_on and bool(self._advance.outputs[0])
        if dt != self._dt:
            self._since, self._frames, self._dt = start, 0, dt
        self._frames += 1
        return going_on

    @property
    def status(self) -> Status:
        """Status of the last step."""
        code = Status(int(self._advance.outputs[1]))
        return Status.NOT_FINITE if code in _GOING_ON and not self._advance.outputs[0] else code

    @property
    def input(self) -> np.ndarray:
        """Input that was applied last, V."""
        return self._input.copy()

    def state(self) -> State:
        """Motion and electrical side now, with the last input still applied."""
        put(self._look.inputs, (self.time, self._advance.state, self._input))
        self._look()
        return jax.tree.map(np.array, self._look.outputs)


def _under_surface(loop: ClosedLoop, depth: float | None, otherwise: float | None) -> ClosedLoop:
    """The loop with the surface where `SteppedVehicle` says."""
    stated = stated_depths(loop.disturbance)
    if depth is not None and stated and stated[0] != depth:
        hint = "Leave one of them out: the surface of waves is `depth` of the waves above the world's origin"
        raise BadInput("depth", f"be that of the scenario's disturbance, {stated[0]:g} m", f"{depth:g} m", hint=hint)
    chosen = otherwise if depth is None else depth
    if stated or chosen is None:
        return loop
    return dataclasses.replace(loop, disturbance=UnderSurface(loop.disturbance, surface(chosen)))


def _begun(loop: ClosedLoop, key: Any, start: Any) -> tuple[Realization, VehicleState]:
    """The loop with its disturbances sampled, and the state at t = 0, by the compiler that takes the steps."""

    first = step_of(lambda loop, _, start: ((), loop.plant.initial_state(*start)), loop, (), start)
    first()
    return realized(loop, key), jax.tree.map(jnp.array, first.outputs)


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


def _state_of(of: Realization, t, x: VehicleState, u: Inputs) -> State:
    plant = of.loop.plant
    assert isinstance(plant, HybridVehicle)
    pose = plant.pose(x)
    acceleration = plant.acceleration(t, x, u, of.load(t, x))[:3]
    force = matvec(pose.rotation.T, acceleration - as_array((0.0, 0.0, STANDARD_GRAVITY)))
    report, battery = plant.thruster.report(x.thrusters), plant.power.battery
    electrical = ()
    if battery is not None:
        taken = plant.thruster.electrical_power(x.thrusters, u).sum()
        charge = x.power.charge
        electrical = jnp.stack([battery.bus_voltage(charge, taken), battery.current(charge, taken)])
    propellers = () if report is None else report.speed
    return State(x.position, x.attitude, pose.velocity, x.nu, force, propellers, electrical)


def _numbers(pair: tuple[str, Any]) -> Any:
    return None if pair[1] is None else np.asarray(pair[1], dtype=float)
