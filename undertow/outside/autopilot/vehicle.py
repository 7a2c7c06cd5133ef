"""The vehicle of a scenario, stepped by another program."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core import checks, runtime
from undertow.core.checks import numbers
from undertow.core.contracts import Measurement
from undertow.core.number_text import counted
from undertow.core.numerics.integrators import COMPACT_METHODS
from undertow.core.numerics.random_keys import key_of_seed
from undertow.core.status import Status
from undertow.outside.autopilot.measured_motion import Format, MeasuredMotion, motion_in
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.plants.pulse_input import applied_voltage, pulse_driven
from undertow.physics.power.esc import ESC
from undertow.physics.power.esc import esc as usual_esc
from undertow.physics.sensors.motion import motion_of
from undertow.physics.vehicles.facts import facts_of
from undertow.report.answers.notebook import in_notebook
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.answers.vehicle_answer import vehicle_lines
from undertow.report.vehicle_view import answer_with_picture
from undertow.scenario.build import Built, build
from undertow.scenario.link_scenario import at_sampling_time, text_of
from undertow.scenario.reading import Text
from undertow.simulation.loop import plant_step
from undertow.simulation.loop.closed_loop import Realization
from undertow.simulation.loop.outcome import status_of
from undertow.simulation.loop.plant_step import PlantObservation, PlantState
from undertow.simulation.loop.stepped import Uncopied, compile_step, copy_into, realized

COMMANDS = ("input", "pulses")

_WHOLE = 1e-9  # sampling times, within which a time is one

# A vehicle that stands upright goes on: nothing here needs Euler angles.
_GOING_ON = (Status.OK, Status.PITCH_SINGULAR)


class VehicleOutput(NamedTuple):
    """What a vehicle shows after a step; NumPy arrays.

    Attributes:
        position, velocity, attitude: measured motion, in the vehicle's format.
        applied: input since the last step, in the unit of the plant's input; None before the first one.
        propellers: speeds, rad/s, and accelerations, rad/s^2, of thrusters that report them; None of others.
        health: 1 per actuator, 0 where it announced that it has failed; None where none can.
        truth: true motion, in the same format.
        specific_force: m/s^2, body axes: true mean since the last step, as an accelerometer has it; () of a plant that
            is no vehicle.
        status: of the true state.
    """

    position: Any
    velocity: Any
    attitude: Any
    applied: Any
    propellers: Any
    health: Any
    truth: MeasuredMotion
    specific_force: Any
    status: Status

    def measurement(self) -> dict[str, Any]:
        """What a controller may know: arguments of `Autopilot.start` and `Autopilot.step`."""
        return {name: getattr(self, name) for name in self._fields[:6]}


class _Given(NamedTuple):
    """Inputs of a step."""

    t: Any  # s, at which it begins
    end: Any  # s, at which it ends
    dt: Any  # s
    command: Any  # that is held


class _Shown(NamedTuple):
    """Outputs of a step."""

    observation: PlantObservation
    measured: MeasuredMotion
    truth: MeasuredMotion
    specific_force: Any


@dataclasses.dataclass(frozen=True)
class _VehicleSteps:
    """Steps of the vehicle of a closed loop.

    Attributes:
        form: of the motions that it shows; None for a plant that is no vehicle.
        integrate: one of `METHODS`.
        substeps: of each step.
    """

    form: Format | None
    integrate: Callable
    substeps: int

    def first(self, part: Realization, start: Any) -> tuple[PlantState, _Shown]:
        state, observation = plant_step.begin(part, start)
        return state, self._shown(observation, observation.truth, jnp.zeros(()))

    def following(self, realization_and_esc: tuple[Realization, ESC | None], state: PlantState, step_inputs: _Given):
        realization, speed_controllers = realization_and_esc
        plant = realization.loop.plant
        t = step_inputs.t
        if speed_controllers is None:
            applied = plant.admissible(state.plant, step_inputs.command)
        else:
            assert isinstance(plant, HybridVehicle)
            applied = applied_voltage(plant, speed_controllers, state.plant, step_inputs.command)
        new = plant_step.hold(realization, state, t, step_inputs.dt, applied, self.integrate, self.substeps)
        status = status_of(realization.loop, new.plant, ())
        going_on = jnp.stack([status == int(good) for good in _GOING_ON]).any()
        # The last valid state is kept.
        new = new._replace(plant=jax.tree.map(lambda n, o: jnp.where(going_on, n, o), new.plant, state.plant))
        new, observation = plant_step.observe(realization, new, step_inputs.end, applied)
        before = plant.output(t, state.plant)
        return new, self._shown(observation._replace(status=status), before, step_inputs.dt)

    def _shown(self, observation: PlantObservation, before: Measurement, dt: Any) -> _Shown:
        truth = observation.truth
        force = ()
        if self.form is not None:
            force = motion_of(truth, before.velocity[:3], dt).specific_force
        measured, true = (motion_in(self.form, motion) for motion in (observation.measurement, truth))
        return _Shown(observation, measured, true, force)


class Vehicle(Uncopied):
    """The vehicle of a scenario, or another plant, with its navigation, disturbances and faults. It is stepped by
    whoever owns the clock; commands go in, measurements come out::

        vehicle = ut.Vehicle("bluerov2_heavy.yaml", attitude="quaternion")
        autopilot = ut.Autopilot("bluerov2_heavy.yaml", attitude="quaternion")
        command = autopilot.start(**vehicle.output.measurement())
        for _ in range(1000):
            command = autopilot.step(**vehicle.step(command).measurement())

    It is compiled when it is made; no step compiles anything. With the commands of a simulation it has the bits of that
    simulation, where the batch compiler knows all parts (`backend`). Its controller and its supervisor are left out.

    A time that is no sampling time is divided into sampling times and a rest, with the command held.

    Args:
        scenario: a .yaml file or an earlier run.nc, the same as a mapping or as read, or what `build` made of it.
        sampling_time: s; None for that of the scenario.
        attitude: format of attitudes, `euler` (roll, pitch, yaw), `quaternion` (w, x, y, z, body -> world) or `both`.
        velocity: format of velocities: `body`, `world`, `rates` or `both`, see `measured_motion.Format`.
        command: what it takes: `input`, in the unit of the plant's input, or `pulses` of speed controllers, us.
        esc: speed controllers for `pulses`; None for those of the scenario, or usual ones.
        seed: of everything random; None for that of the scenario.
        allow_code: whether the Python code that an earlier run.nc names may run; that of a .yaml file may.

    Attributes:
        sampling_time: s.
        duration: of the scenario, s.
        thrusters: how many inputs there are.
        unit: of a command.
        plant: of the scenario.
        esc: speed controllers; None unless they take pulses.
        precision: `float64` or `float32`.
        backend: `simd` or `xla`.
        output: what the vehicle shows now.

    Raises:
        BadInput: something given cannot be used.
    """

    def __init__(
        self,
        scenario: str | Path | Mapping[str, Any] | Text | Built,
        *,
        sampling_time: float | None = None,
        attitude: str = "euler",
        velocity: str = "body",
        command: str = "input",
        esc: ESC | None = None,
        seed: int | None = None,
        allow_code: bool = False,
    ):
        if sampling_time is not None:
            checks.positive("sampling_time", sampling_time, "s")
        checks.choice("command", command, COMMANDS)
        form = Format(attitude, velocity)
        form.check()
        built = scenario
        if not isinstance(built, Built):
            built = build(at_sampling_time(text_of(built, allow_code), sampling_time))
        settings = built.scenario.loop
        self._loop, self._title = built.closed_loop, built.scenario.description
        self.sampling_time = float(settings.dt if sampling_time is None else sampling_time)
        self.duration = float(settings.duration)
        self.plant, self.esc, self.unit = self._loop.plant, None, self._loop.plant.input_unit
        if command == "pulses":
            driven = pulse_driven(self.plant, battery_suffices=True)
            self.esc = esc or driven.power.esc or usual_esc()
            self.unit = "us"
        self.thrusters = self.plant.inputs()
        self.precision = built.scenario.precision
        with runtime.on_processor(), runtime.in_precision(self.precision):
            initial = built.scenario.initial
            self._start = self._loop.outputs_at_start(initial.position, initial.velocity)
            truth = self.plant.output(jnp.zeros(()), self.plant.initial_state())
            self._form = None if truth.body is None else form
            integrate = COMPACT_METHODS.get(settings.method, COMPACT_METHODS["rk4"])
            steps = _VehicleSteps(self._form, integrate, settings.substeps)
            self._compile(steps, key_of_seed(built.scenario.seed if seed is None else seed))
        self._restart()

    def _compile(self, steps: _VehicleSteps, key: Any) -> None:
        realization = self._realization = realized(self._loop, key)
        self._begin = compile_step(lambda part, _, start: ((), steps.first(part, start)), realization, (), self._start)
        self._begin()
        types, _ = eqx.filter_eval_shape(steps.first, realization, self._start)
        state = jax.tree.map(lambda value, like: jnp.asarray(value, like.dtype), self._begin.outputs[0], types)
        zero = np.zeros((), dtype=jax.dtypes.canonicalize_dtype(float))
        step_inputs = _Given(zero, zero, zero, np.zeros(self.thrusters, dtype=zero.dtype))
        self._go_on = compile_step(steps.following, (realization, self.esc), state, step_inputs)
        self.backend = self._go_on.backend

    def restart(self, seed: int | None = None) -> VehicleOutput:
        """Go back to time zero and the start that the scenario states; everything random is that of the seed.

        Args:
            seed: None for that of the present run: the same disturbances, noise and faults.
        """
        if seed is not None:
            with runtime.on_processor(), runtime.in_precision(self.precision):
                self._realization = realized(self._loop, key_of_seed(seed))
                numbers_of_seed = eqx.filter(self._realization, eqx.is_array)
            copy_into(self._begin.numbers, numbers_of_seed)
            copy_into(self._go_on.numbers[0], numbers_of_seed)
            self._begin()
        self._restart()
        return self.output

    def _restart(self) -> None:
        copy_into(self._go_on.state, self._begin.outputs[0])
        self._show(self._begin.outputs[1])
        self.output = self.output._replace(applied=None)
        self._since, self._steps, self._dt = 0.0, 0, self.sampling_time

    def _repr_html_(self) -> str:
        """What a notebook shows: where its run stands, what it takes, and of a vehicle its numbers and thrusters."""
        verdict = f"It is at {self.time:g} s of {self.duration:g} s, and its state is valid."
        if not self.going_on:
            verdict = f"It ended: {self.output.status.word.replace('_', ' ')} at {self.time:g} s."
        step = f"{1e3 * self.sampling_time:g} ms"
        commands = f"{counted(self.thrusters, 'command')} ({self.unit})"
        inputs = f"Each step takes {commands}, held for {step} or the time that is given."
        good = None if self.going_on else False
        if not isinstance(self.plant, HybridVehicle):
            return in_notebook(self._title or type(self.plant).__name__, PlainAnswer(good, verdict, (inputs,)))
        vehicle = self.plant.vehicle
        lines = (inputs, *vehicle_lines(facts_of(vehicle)))
        return answer_with_picture(self._title or vehicle.name, PlainAnswer(good, verdict, lines), vehicle)

    @property
    def realization(self) -> Realization:
        """The closed loop with everything random, whose controller takes no part."""
        return self._realization

    @property
    def state(self) -> Any:
        """State of the plant; arrays that the next step overwrites."""
        return self._go_on.state.plant

    @property
    def time(self) -> float:
        """s since the start; a multiple of the length of a step where all were alike, as in a simulation."""
        return self._since + self._steps * self._dt

    @property
    def going_on(self) -> bool:
        """Whether the state is valid; the last valid one is kept where it is not, and `output.status` says why."""
        return self.output.status in _GOING_ON

    def step(self, command: Any, dt: float | None = None) -> VehicleOutput:
        """Hold a command for a time; thrusters limit it to what they can give.

        Args:
            command: one entry per thruster or other input.
            dt: s; None for one sampling time.

        Returns:
            What the vehicle shows afterwards.

        Raises:
            BadInput: another shape, a number that is not finite, or a time that is not positive.
        """
        command = numbers("command", command, (self.thrusters,))
        checks.finite("command", command)
        if dt is None:
            self._step(command, self.sampling_time)
            return self.output
        checks.positive("dt", dt, "s")
        whole_steps = int(dt / self.sampling_time * (1 + _WHOLE))
        remainder = dt - whole_steps * self.sampling_time
        for _ in range(whole_steps):
            self._step(command, self.sampling_time)
        if remainder > _WHOLE * self.sampling_time:
            self._step(command, remainder)
        return self.output

    def _step(self, command: np.ndarray, dt: float) -> None:
        t = self.time
        if dt != self._dt:
            self._since, self._steps, self._dt = t, 0, dt
        self._steps += 1
        copy_into(self._go_on.inputs, _Given(np.asarray(t), np.asarray(self.time), np.asarray(dt), command))
        self._go_on()
        self._show(self._go_on.outputs)

    def _show(self, output_of_step: _Shown) -> None:
        copied = jax.tree.map(np.copy, output_of_step)
        observation, measured = copied.observation, copied.measured
        propellers = tuple(jax.tree.leaves(observation.measurement.actuator)) or None
        self.output = VehicleOutput(
            measured.position,
            measured.velocity,
            measured.attitude,
            observation.applied,
            propellers,
            observation.measurement.health,
            copied.truth,
            copied.specific_force,
            Status(int(observation.status)),
        )
