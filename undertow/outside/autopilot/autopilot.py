"""One compiled controller, stepped by somebody else's clock."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.control.supervision.conditions import Request, reason_of, state_of
from undertow.control.supervision.supervised_controller import SupervisedState, state_in, transfer
from undertow.control.supervision.supervisor import largest_estimate
from undertow.control.supervision.transition_log import SupervisorTransition, transitions
from undertow.core import checks, runtime
from undertow.core.arrays import in_present_precision
from undertow.core.authority import authority_of
from undertow.core.contracts import Target, starting_at
from undertow.core.errors import BadInput
from undertow.core.signals import Signal
from undertow.outside.autopilot.clock import StepClock
from undertow.outside.autopilot.functions import Functions
from undertow.outside.autopilot.measured_motion import Format, MeasuredMotion
from undertow.outside.autopilot.output import output_of
from undertow.outside.autopilot.saved_state import packed, restore_arrays
from undertow.outside.autopilot.step_arguments import StepArguments, is_no_rotation
from undertow.outside.autopilot.step_log import ReceivedStep, StepLog, law_signals, received_signals
from undertow.physics.power.esc import ESC
from undertow.scenario.build import Built, build
from undertow.scenario.link_scenario import at_sampling_time, text_of
from undertow.scenario.reading import Text
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.stepped import Uncopied, compile_step, copy_into


class Autopilot(Uncopied):
    """A controller that is called once per sampling time, by whoever owns the clock. NumPy goes in and comes out::

        autopilot = ut.Autopilot("bluerov2_heavy.yaml", attitude="quaternion")
        autopilot.start(position, velocity, quaternion)
        while True:
            volts = autopilot.step(position, velocity, quaternion, target=[2, 1, 1, 0, 0, 0.5])

    It is compiled when it is made; no step compiles anything. A step takes microseconds where the batch compiler knows
    the controller, and some hundred where it does not (`backend`). The same measurements give the same bits as in
    `undertow simulate`.

    Steps come when they come: `dt` is the time since the last one. A step is late from 1.5 sampling times on; from 5 on
    it is missed, and the law advances by 5 sampling times only. With `dt` zero, negative or not finite the last output
    is repeated. `counts` says how often each happened.

    Entries of a measurement that are not finite are replaced by those that the law's model expects. A law whose command
    is not finite, or whose estimate of the uncertainty is beyond ten times what the actuators can give, repeats its
    last output once. Then it starts anew from the next whole measurement, and its output is zero until there is one
    (`restarted`); a supervisor does that by itself.

    Args:
        scenario: a .yaml file or an earlier run.nc, the same as a mapping or as read, a closed loop made of parts, or
            what `build` made of a scenario, whose reference begins where the scenario's plant does.
        sampling_time: s; None for that of the scenario. Rules choose the gains of a scenario for this one; parts that
            are made already keep theirs. A closed loop needs one.
        attitude: format of measured attitudes, `euler` (roll, pitch, yaw), `quaternion` (w, x, y, z, body -> world) or
            `both`.
        velocity: format of measured velocities: `body`, `world`, `rates` or `both`, see `measured_motion.Format`.
        output: what the vehicle takes: `input`, `newtons`, `pulses` or `wrench`, see `output.Output`.
        esc: speed controllers for `pulses`; None for usual ones.
        blend: time constant, s, with which the output turns from that before the start into that of the law.
        log: .mcap file for measurement, target, command and signals of every step; None for none. A thread writes it,
            so that no step waits for the disk; `close_log` finishes it, and `kill -9` costs the last second.
        log_later: whether a step is written by `log_step` only: its command can be sent before.
        allow_code: whether the Python code that an earlier run.nc names may run; that of a .yaml file may.

    Attributes:
        sampling_time: s.
        unit: of the output.
        plant: of the scenario.
        precision: `float64` or `float32`.
        backend: `simd` or `xla`.

    Raises:
        BadInput: something given cannot be used.
    """

    _instead = "Make another one, and `restore` there what `save` gives"

    def __init__(
        self,
        scenario: str | Path | Mapping[str, Any] | Text | ClosedLoop | Built,
        *,
        sampling_time: float | None = None,
        attitude: str = "euler",
        velocity: str = "body",
        output: str = "input",
        esc: ESC | None = None,
        blend: float = 1.0,
        log: str | Path | None = None,
        log_later: bool = False,
        allow_code: bool = False,
    ):
        if sampling_time is not None:
            checks.positive("sampling_time", sampling_time, "s")
        loop, precision, usual = _given(scenario, allow_code, sampling_time)
        period = usual if sampling_time is None else sampling_time
        if period is None:
            raise BadInput("sampling_time", "be given with a closed loop made of parts")
        checks.positive("blend", blend, "s")
        form = Format(attitude, velocity)
        form.check()
        self._loop = loop
        self.precision = precision
        self.sampling_time = float(period)
        self._blend = float(blend)
        conversion = output_of(output, loop.plant, loop.controller, esc)
        self.unit, self.plant = conversion.unit, loop.plant
        with runtime.on_processor(), runtime.in_precision(precision):
            self._compile(Functions(loop, form, conversion))
            self._largest_estimate = _largest_estimate(loop)
        self._clock = StepClock(self.sampling_time)
        self._command, self._before = np.zeros_like(self._convert.inputs), np.zeros_like(self._convert.inputs)
        self._blended, self._started, self._broken = (np.zeros((), dtype=bool) for _ in range(3))
        self._restarts = np.zeros((), dtype=int)
        motion, report, target, status = self._begin.inputs
        self._received = ReceivedStep(motion, report, target, status, np.zeros_like(self._command), 0.0)
        self._log_later, self._logged, self._log = log_later, True, None
        if log is not None:
            self.log_to(log)

    def log_to(self, path: str | Path) -> None:
        """Write the steps from now on to a .mcap file, as with `log`.

        Raises:
            BadInput: it cannot be written.
        """
        plant, law = self._loop.plant, self._loop.controller
        received = received_signals(plant, self._form, self._received.numbers())
        written = law_signals(plant, law, law.signals(), self._go_on.outputs.signals) | received
        form = self._form or Format("", "")
        facts = {"attitude": form.attitude, "velocity": form.velocity, "precision": self.precision}
        self.close_log()
        self._log = StepLog(path, written, self.sampling_time, self, facts)

    def close_log(self) -> None:
        """Finish the log, if there is one; later steps are not written."""
        if self._log is not None:
            self._log.close()

    def _compile(self, functions: Functions) -> None:
        self._form, zero = functions.form, jnp.zeros(len(self._loop.plant.outputs))
        steps = functions.steps
        self._begin = compile_step(
            lambda law, _, received: ((), steps.first(law, received)), functions.controller, (), functions.given
        )
        memory = self._begin.outputs[0]
        inputs = (functions.given, functions.applied, functions.time + self.sampling_time)
        self._go_on = compile_step(
            lambda law, memory, received: steps.following(law, memory, *received), functions.controller, memory, inputs
        )
        self._convert = compile_step(lambda output, _, u: ((), output.of(u)), functions.output, (), functions.applied)
        self._at = compile_step(
            lambda reference, _, t: ((), reference.at(t)), starting_at(functions.reference, zero), (), functions.time
        )
        self.backend = self._go_on.backend
        # What every step needs, looked up once. The arrays of the state are those of every step.
        self._supervisor = state_in(self._go_on.state)
        self._takes_raw_readings = self._loop.controller.takes_raw_readings
        self._arguments = StepArguments(self._begin.inputs, len(self._convert.inputs))

    def start(
        self,
        position: Any,
        velocity: Any,
        attitude: Any = (),
        *,
        target: Any = None,
        applied: Any = None,
        propellers: Any = None,
        health: Any = None,
    ) -> np.ndarray:
        """The first step, which sets all states of the controller.

        Args:
            position: m, north, east, down; or all outputs of a plant that is no vehicle.
            velocity: in the format of this autopilot; the rates of the outputs of another plant.
            attitude: in the format of this autopilot; nothing for another plant.
            target: outputs to reach, or (outputs, rates, accelerations); None for the scenario's reference, which then
                begins here.
            applied: input that has been applied so far, in the unit of the plant's input: the output begins there, and
                turns into the law's: within `blend`, or as fast as a supervisor allows. None for the law's at once.
            propellers: speeds, rad/s, or (speeds, accelerations), of thrusters that report them; None at rest.
            health: per actuator, 1, or 0 where it announced that it has failed, in a scenario with such faults; None
                where none has.

        Returns:
            The output, one entry per actuator, or six of a wrench.

        Raises:
            BadInput: a shape is wrong, or a number is not finite, or the law's command is not: then call `start` again.
        """
        arguments = self._arguments
        motion = arguments.motion(position, velocity, attitude)
        for name, value in zip(MeasuredMotion._fields, motion, strict=True):
            checks.finite(name, value)
        if is_no_rotation(motion.attitude):
            raise BadInput(
                "attitude", "be a quaternion of some length", f"of length {np.hypot.reduce(motion.attitude):.3g}"
            )
        before = np.zeros_like(self._command) if applied is None else arguments.input(applied)
        report = arguments.report(propellers, missing=0.0)
        for value in jax.tree.leaves(report):
            checks.finite("propellers", value)
        applied_input = np.full_like(before, np.nan) if applied is None else before.copy()  # the caller's may change
        self._received = ReceivedStep(
            motion, report, self._target(target), arguments.health(health), applied_input, 0.0
        )
        copy_into(self._begin.inputs, self._received[:4])
        self._begin()
        self._clock.begin()
        if target is None:  # the reference begins here
            self._place_reference(self._begin.outputs[0].y.position)
            self._received = self._received._replace(target=self._target(None))
            copy_into(self._begin.inputs.target, self._received.target)
            self._begin()
        if not np.isfinite(self._begin.outputs[1].command).all():
            raise BadInput(
                "start", "lead to a finite command of the law", "one that is not", hint="Check the measurement"
            )
        copy_into((self._go_on.state, self._go_on.outputs), self._begin.outputs)
        if self._supervisor is not None and applied is not None:
            self._turn_from(before, self._supervisor)
        self._command[...] = before
        blended = applied is not None and not self.supervised
        self._before[...], self._blended[...], self._started[...] = before, blended, True
        self._broken[...], self._restarts[...] = False, 0
        return self._answered()

    def step(
        self,
        position: Any,
        velocity: Any,
        attitude: Any = (),
        *,
        target: Any = None,
        applied: Any = None,
        propellers: Any = None,
        health: Any = None,
        dt: float | None = None,
    ) -> np.ndarray:
        """One control step.

        Args:
            position: as for `start`; entries that are not finite were not measured, likewise below, and neither was a
                quaternion of zeros.
            velocity: as for `start`.
            attitude: as for `start`.
            target: as for `start`.
            applied: input applied since the last step, in the unit of the plant's input; None, and entries that are not
                finite, for the commanded one.
            propellers: as for `start`; None where they were not measured.
            health: as for `start`.
            dt: time since the last step, s; None for the sampling time.

        Returns:
            The output.

        Raises:
            BadInput: a shape is wrong, a target is not finite, or `start` was not called.
        """
        self._check_started("step")
        arguments = self._arguments
        motion = arguments.motion(position, velocity, attitude)
        if is_no_rotation(motion.attitude):
            motion = motion._replace(attitude=np.full(4, np.nan))  # so drivers say that they have none yet
        applied_input = self._command.copy() if applied is None else arguments.reported(applied, self._command)
        report = arguments.no_report if propellers is None else arguments.report(propellers, missing=np.nan)
        new_target = None if target is None else arguments.target(target)  # before anything changes
        healthy = arguments.health(health)
        passed = self._clock.passed(dt)
        elapsed = self.sampling_time if dt is None else float(dt)
        if self._takes_raw_readings:
            passed = elapsed  # whatever it is: a supervisor knows what to do with it
        elif not passed:
            return self._convert.outputs.copy()
        self._received = ReceivedStep(motion, report, new_target or self._target(None), healthy, applied_input, elapsed)
        copy_into(self._go_on.inputs, (*self._received[:5], passed))
        self._go_on()
        if not self.supervised:
            self._start_again_if_broken()
        return self._answered()

    def _is_broken(self) -> bool:
        """Whether the law has diverged: it would not come back, or only in hours."""
        answer = self._go_on.outputs
        estimate = answer.signals.get("estimate", np.zeros(()))
        return not (np.isfinite(answer.command).all() and (np.abs(estimate) <= self._largest_estimate).all())

    def _start_again_if_broken(self) -> None:
        """From the second step in a row with a broken law on."""
        if not self._is_broken():
            self._broken[...] = False
        elif not self._broken:
            self._broken[...] = True
        else:
            copy_into(self._begin.inputs, self._received[:4])
            self._begin()
            copy_into((self._go_on.state, self._go_on.outputs), self._begin.outputs)
            self._restarts += 1
            self._command[...] = 0.0  # unless the command is finite now

    def save(self) -> bytes:
        """The state: law, time, counts, output. An autopilot that is made alike goes on from it with the same bits.

        Raises:
            BadInput: `start` was not called.
        """
        self._check_started("save")
        return packed(self._identity(), self._state_arrays())

    def restore(self, state: bytes) -> None:
        """Go on from a state that `save` gave.

        Raises:
            BadInput: it is damaged, or of another controller; everything stays as it was.
        """
        restore_arrays(self._state_arrays(), state, self._identity())

    def _state_arrays(self) -> list[np.ndarray]:
        """Everything that changes from step to step."""
        steps = self._go_on.state, self._go_on.outputs, self._at.numbers, self._convert.outputs
        arrays = self._command, self._before, self._blended, self._started, self._broken, self._restarts
        return [*jax.tree.leaves(steps), *arrays, self._clock.numbers]

    def _identity(self) -> bytes:
        """What states have in common that may be exchanged: structure and numbers of the controller, and formats."""
        numbers = jax.tree.leaves((self._go_on.numbers, self._convert.numbers))
        forms = jax.tree.structure((self._go_on.state, self._go_on.outputs)), self._form, self.unit, self.sampling_time
        return repr(forms).encode() + b"".join(number.tobytes() for number in numbers)

    def _check_started(self, method: str) -> None:
        if not self._started:
            raise BadInput("start", f"be called before `{method}`", "not")

    @property
    def counts(self) -> dict[str, int]:
        """Steps after the first one, those that were late, missed or repeated, and new starts of a broken law.

        `not recorded` counts the steps that are missing in the log because the disk was too slow.
        """
        unlogged = 0 if self._log is None else self._log.dropped
        return self._clock.counts | {"restarted": int(self._restarts), "not recorded": unlogged}

    @property
    def supervised(self) -> bool:
        """Whether a supervisor stands around the controller, which then has a state, transitions and requests."""
        return self._supervisor is not None

    def request(self, what: str) -> None:
        """Ask the supervisor for something, from the next step on.

        Args:
            what: `run` (and on to the target, where a place is held after a jump), `hold` (the safe output until
                another request), `stop` (the same until `start`), `law` or `fallback` (which of them controls).

        Raises:
            BadInput: there is no such request, the scenario has no supervisor, or `start` was not called.
        """
        self._check_started("request")
        checks.choice("request", what, tuple(known_request.name.lower() for known_request in Request))
        supervised = self._supervised("request")
        request = Request[what.upper()]
        supervised.request[...] = int(request)
        if request is Request.RUN:
            supervised.place.held[...] = 0

    @property
    def state(self) -> tuple[str, str]:
        """State of the supervisor after the last step, and its reason: ("DEGRADED", "thruster_lost").

        Raises:
            BadInput: the scenario has no supervisor, or `start` was not called.
        """
        self._check_started("state")
        z = self._supervised("state")
        return state_of(int(z.state)).name, reason_of(int(z.reason))

    @property
    def supervision(self) -> str:
        """State and reason of the supervisor in words, such as `DEGRADED (place_held)`; "" where there is none."""
        if not (self._started and self.supervised):
            return ""
        state, reason = self.state
        return f"{state} ({reason})" if reason else state

    def transitions(self) -> Sequence[SupervisorTransition]:
        """The last transitions of the supervisor, oldest first.

        Raises:
            BadInput: as of `state`.
        """
        self._check_started("transitions")
        return transitions(self._supervised("transitions").log)

    def _supervised(self, method: str) -> SupervisedState:
        """State of the supervisor, of which the arrays can be written into."""
        if self._supervisor is None:
            raise BadInput(method, "be used with a supervisor", "none", hint="Add `supervisor: true` to the scenario")
        return self._supervisor

    def signals(self) -> dict[str, np.ndarray]:
        """Values of the signals of the last step: those that the law declares, and `command`, its input.

        Raises:
            BadInput: `start` was not called.
        """
        self._check_started("signals")
        answer = self._go_on.outputs
        return {"command": answer.command.copy()} | {name: value.copy() for name, value in answer.signals.items()}

    def declared_signals(self) -> dict[str, Signal]:
        """Unit and meaning of the signals, by name."""
        command = Signal(("actuator",), self._loop.plant.input_unit, "input that the law commands")
        return {"command": command} | self._loop.controller.signals()

    def _target(self, target: Any) -> Target:
        """The target as given, or of the scenario's reference now."""
        if target is not None:
            return self._arguments.target(target)
        self._at.inputs[...] = self._clock.time
        self._at()
        return self._at.outputs

    def _place_reference(self, position: np.ndarray) -> None:
        with runtime.on_processor(), runtime.in_precision(self.precision):
            placed = in_present_precision(starting_at(self._loop.reference, jnp.asarray(position)))
        copy_into(self._at.numbers, eqx.filter(placed, eqx.is_array))

    def _turn_from(self, applied: np.ndarray, supervised: SupervisedState) -> None:
        """Begin at an input: the supervisor turns it into that of the law, no faster than its `slew`."""
        low, high, most = transfer(self._loop.controller)
        begun = np.clip(applied, low, high)
        command = self._go_on.outputs.command
        beyond = begun - command
        supervised.beyond[...] = beyond - np.clip(beyond, -most, most)
        command[...] += supervised.beyond

    def _answered(self) -> np.ndarray:
        """The output for the law's command; a command that is not finite leaves the output as it was."""
        command = self._go_on.outputs.command
        if np.isfinite(command).all():
            share = np.exp(-self._clock.time / self._blend) if self._blended else 0.0
            self._command[...] = share * self._before + (1 - share) * command if share else command
        self._convert.inputs[...] = self._command
        self._convert()
        self._logged = False
        if not self._log_later:
            self.log_step()
        return self._convert.outputs.copy()

    def log_step(self) -> None:
        """Write the last step to the log, if there is one and it has not been written; a repeated step is none."""
        if self._log is None or self._logged:
            return
        self._logged = True
        memory = self._go_on.state
        step_signals = {
            "measured_position": memory.y.position,
            "measured_velocity": memory.y.velocity,
            "reference": memory.r.position,
            "commanded_input": self._command,
        }
        signals = self._go_on.outputs.signals
        self._log.append(self._clock.time, step_signals | signals | self._received.numbers())


def _given(scenario: Any, allow_code: bool, sampling_time: float | None) -> tuple[ClosedLoop, str, float | None]:
    """Closed loop, precision and sampling time of what an autopilot is made from."""
    if isinstance(scenario, ClosedLoop):
        return scenario, "float64", None
    built = scenario
    placed = isinstance(scenario, Built)
    if not isinstance(built, Built):
        built = build(at_sampling_time(text_of(built, allow_code), sampling_time))
    if built.scenario.loop.kind != "sampled":
        raise BadInput("loop.kind", "be sampled for an autopilot", built.scenario.loop.kind)
    loop = built.closed_loop
    if not placed:
        # Its faults do not act here, but their announcements are part of a measurement.
        healthy = built.without_faults().closed_loop
        loop = dataclasses.replace(healthy, reference=built.reference, faults=loop.faults)
    return loop, built.scenario.precision, built.scenario.loop.dt


def _largest_estimate(loop: ClosedLoop) -> Any:
    """Largest plausible estimate of the uncertainty; without limit where the law has no nominal model."""
    model = getattr(loop.controller, "model", None)
    return np.inf if model is None else np.asarray(largest_estimate(authority_of(model, loop.plant)))
