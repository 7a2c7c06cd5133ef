"""A supervised controller: gates around a controller, states with reasons, restarts, and a safe output."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PyTree

from undertow.control.supervision.condition_values import CLOCK_FAULT, RESTART_WINDOW, ConditionValues, Occasion, View
from undertow.control.supervision.conditions import (
    CONDITIONS,
    MEMORY,
    NAMES,
    NUMBER,
    OPERATOR,
    Conditions,
    PerCondition,
    Request,
    State,
    code_of,
    held_for,
    none_held,
    state_of_levels,
)
from undertow.control.supervision.fault_tolerant_law import FaultTolerantController
from undertow.control.supervision.held_place import PlaceState, after_jump, is_another, no_place, released, target
from undertow.control.supervision.limit_swings import SwingState, no_swings, swung
from undertow.control.supervision.measurement_gate import GateState, MeasurementGate, conceivable
from undertow.control.supervision.motion import rate_of_velocity
from undertow.control.supervision.reported_input import ReportedInput, ReportState
from undertow.control.supervision.tracking_allowance import AllowanceState, TrackingAllowance
from undertow.control.supervision.transition_log import TransitionLog, empty_log, logged
from undertow.core import checks
from undertow.core.contracts import AbstractController, Inputs, Measurement, Model, Outputs, Target
from undertow.core.expected_measurement import all_finite
from undertow.core.param import Param, param
from undertow.core.signals import Signal

_ADVANCED = 3.0  # sampling times by which a law advances at most
_PREDICTED = 0.5  # s for which the motion is predicted at most
_AVERAGED = 0.5  # s over which the variation of the input is averaged
_BELIEVED = 0.1  # share of a jump that the estimate may add to a prediction in a step
_SHORTEST = 1e-3  # sampling times between two steps of a clock that runs
_TURNS = 1e5  # rad, of a reference
_MOVED = ("measurement_jump", "measurement_inconsistent")  # after which the vehicle may be anywhere
_SUDDEN = 0.05  # s in which no vehicle reaches its largest speed
_LONG_AGO = -1e9  # s
_BIG = 1e30  # stands for what is not finite in the log

SIGNALS = {
    "supervisor_state": Signal((), "1", "0 INIT, 1 READY, 2 ACTIVE, 3 DEGRADED, 4 SAFE, 5 STOPPED"),
    "supervisor_reason": Signal(
        (), "1", "code of the reason of that state: its line in the table of conditions; 0 for none"
    ),
    "supervisor_value": Signal((), "1", "value of that condition, or of none 0"),
    "supervisor_limit": Signal((), "1", "its limit"),
    "supervisor_transitions": Signal((), "1", "transitions so far"),
    "supervisor_restarts": Signal((), "1", "restarts of the law so far"),
    "fallback_controls": Signal((), "1", "1 while the fallback controls in place of the law"),
}


Scalar = Float[Array, ""]


class SupervisedState(NamedTuple):
    """State z of a supervised controller."""

    law: PyTree
    fallback: PyTree  # () without one
    gate: GateState
    report: ReportState
    reference: Target  # last valid one that was given
    place: PlaceState
    allowance: AllowanceState
    conditions: Conditions
    state: Int[Array, ""]
    reason: Int[Array, ""]
    cause: Float[Array, "2"]  # value and limit of the reason
    exceeding: PerCondition  # last value of each condition beyond its limit
    time: Float[Array, ""]  # s since the start
    safe_for: Float[Array, ""]  # s in SAFE
    output: Inputs  # applied last
    transfer: Int[Array, ""]  # 1 where control has begun with this step, and `beyond` is not known yet
    beyond: Inputs  # by which the output exceeds that of the law since a transfer; it ends no slower than `slew`
    variation: Float[Array, ""]  # of the input, ranges per second, averaged
    swings: SwingState
    restarts: Float[Array, " kept"]  # times of the last restarts, s, the latest first
    restarted: Int[Array, ""]  # how often
    fallback_controls: Int[Array, ""]
    request: Int[Array, ""]
    log: TransitionLog


class Supervised(AbstractController):
    """A controller between gates. Where nothing is wrong its input has the bits of the controller's own.

    Raises:
        BadInput: an option is out of its range.
    """

    law: AbstractController
    fallback: AbstractController | None
    gate: MeasurementGate
    report: ReportedInput
    tracking: TrackingAllowance
    watch: ConditionValues
    model: Model
    sampling_time: Float[Param, ""] = param("s", "between two steps")
    safe_output: Float[Param, " m"] = param("as input", "input in all states but ACTIVE and DEGRADED")
    slew: Float[Param, ""] = param("1/s", "fastest change of the input at a transfer, ranges from limit to limit")
    stop_after: Float[Param, ""] = param("s", "time in SAFE after which the state is STOPPED")
    hold_after_jump: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        for name in ("sampling_time", "slew", "stop_after"):
            checks.positive(name, getattr(self, name), finite=False)
        checks.finite("safe_output", self.safe_output)

    def init(self, y: Measurement, r: Target) -> SupervisedState:
        y = conceivable(y)
        gate = self.gate.init(y)
        passed = self.gate.pass_through(gate, y, jnp.asarray(True))
        target, _ = self._checked(Target(*map(jnp.zeros_like, r)), r)
        usable = (passed.not_finite == 0) & (passed.implausible <= 1)
        measurement = passed.measurement
        law = self.law.init(measurement, target)
        fallback = () if self.fallback is None else self.fallback.init(measurement, target)
        allowance = self.tracking.start(self.model.coordinates, measurement, target)
        new = self._fresh(law, fallback, gate, measurement, allowance, target)
        log, zero, none = new.log, jnp.zeros(()), jnp.zeros((), dtype=int)
        for entered in (State.READY, State.ACTIVE):
            log = logged(log, usable, (zero, jnp.asarray(int(entered)), none, zero, zero))
        state = jnp.where(usable, int(State.ACTIVE), int(State.INIT)).astype(int)
        return new._replace(state=state, transfer=jnp.where(usable, 0, 1).astype(int), log=log)

    def _fresh(
        self, law: PyTree, fallback: PyTree, gate: GateState, y: Measurement, allowance: AllowanceState, r: Target
    ) -> SupervisedState:
        """A state in which nothing has happened yet, in INIT."""
        zero, none = jnp.zeros(()), jnp.zeros((), dtype=int)
        return SupervisedState(
            law=law,
            fallback=fallback,
            gate=gate,
            report=self.report.init(self.model, y, self.safe_output),
            reference=r,
            place=no_place(r),
            allowance=allowance,
            conditions=none_held(),
            state=jnp.asarray(int(State.INIT)),
            reason=none,
            cause=jnp.zeros(2),
            exceeding=jnp.zeros(len(NAMES)),
            time=zero,
            safe_for=zero,
            output=self.safe_output,
            transfer=jnp.ones((), dtype=int),
            beyond=jnp.zeros_like(self.safe_output),
            variation=zero,
            swings=no_swings(self.safe_output),
            restarts=jnp.full(self.watch.restarts + 1, _LONG_AGO),
            restarted=none,
            fallback_controls=none,
            request=jnp.asarray(int(Request.RUN)),
            log=empty_log(),
        )

    def command(self, z: SupervisedState, y: Measurement, r: Target):
        view = self._view(z, y, r)
        supervisor_signals = {
            "supervisor_state": z.state,
            "supervisor_reason": z.reason,
            "supervisor_value": z.cause[0],
            "supervisor_limit": z.cause[1],
            "supervisor_transitions": z.log.number,
            "supervisor_restarts": z.restarted,
            "fallback_controls": z.fallback_controls,
        }
        return view.output, view.signals | supervisor_signals

    def advance(self, z: SupervisedState, y: Measurement, r: Target, u_applied: Inputs, dt) -> SupervisedState:
        view, nominal = self._view(z, y, r), self.sampling_time
        runs = jnp.isfinite(dt) & (dt > _SHORTEST * nominal)
        elapsed = jnp.where(runs, jnp.minimum(dt, _PREDICTED), nominal)
        step = jnp.where(runs & (dt <= CLOCK_FAULT * nominal), jnp.minimum(dt, _ADVANCED * nominal), nominal)
        reported = jnp.where(
            jnp.isfinite(u_applied), jnp.clip(u_applied, self.watch.low, self.watch.high), self.safe_output
        )
        report = self.report.after(z.report, self.model, view.passed.measurement, reported, view.output, elapsed)
        contradicted = self.report.contradicted(report)
        u = jnp.where(contradicted > 1, view.output, reported)
        laws = self._advanced(z, view, u, step)
        broken = ~all_finite(laws)
        allowance = self._allowance(z, view, elapsed)
        variation = self._variation(z, view, u, step)
        swings = swung(z.swings, view.output, self.watch.low, self.watch.high, step)
        swings = jax.tree.map(lambda swing: jnp.where(view.controls, swing, 0.0), swings)
        occasion = Occasion(
            u=u,
            contradicted=contradicted,
            errors=self.tracking.ratios(allowance, self.model.coordinates, view.passed.measurement, view.r),
            variation=variation,
            swings=swings.rate.max(),
            restarts=(z.time - z.restarts < RESTART_WINDOW).sum(dtype=float),
            broken=broken,
            place_held=z.place.held > 0,
            elapsed=jnp.where(runs, dt / nominal, jnp.nan),
        )
        values, limits = self.watch.values(view, occasion, self.model.coordinates), self.watch.limits()
        holds = ~(values <= limits)  # NaN is beyond every limit
        conditions = held_for(z.conditions, holds, elapsed, self._tolerated(z))

        divergence = NUMBER["estimator_diverged"]
        at_once = (jnp.arange(len(NAMES)) == divergence) & broken & view.controls
        conditions = conditions._replace(level=jnp.where(at_once, jnp.maximum(conditions.level, 1.0), conditions.level))
        condition_state, reason = state_of_levels(conditions.level)
        state, reason = self._next(z, view, condition_state, reason)
        begins = _controls(state) & ~view.controls
        diverged = view.controls & (
            broken | (holds[divergence] & (conditions.held[divergence] >= CONDITIONS[divergence].degraded_after))
        )
        by_fallback = self._by_whom(z, conditions)
        switches = by_fallback != (z.fallback_controls > 0)
        # A law whose memory was damaged does not advance to a finite state; that is cheaper to see than the damage.
        without_laws = z._replace(law=(), fallback=())
        damaged = ~all_finite(without_laws) | jax.lax.cond(
            broken, lambda: ~all_finite((z.law, z.fallback)), lambda: jnp.asarray(False)
        )
        begins_again = begins | diverged | switches | damaged
        place = released(z.place, is_another(z.reference, view.given, self.model.coordinates, elapsed))
        jumps, safe = self._jumped(conditions), state == int(State.SAFE)
        place = after_jump(place, ~_controls(state), safe, jumps, begins, view.passed.measurement, view.given)
        counted = (begins & (z.state == int(State.SAFE))) | (diverged & _controls(state))
        times = jnp.where(counted, _with_restart(z.restarts, z.time), z.restarts)
        # What has begun again gets its time before it is judged.
        judged_anew = jnp.arange(len(NAMES)) == divergence
        conditions = conditions._replace(held=jnp.where(judged_anew & begins_again, 0.0, conditions.held))
        time, changed = z.time + elapsed, (state != z.state) | (reason != z.reason)
        # A condition may be named after it has held: its value is the last one beyond the limit.
        exceeding = jnp.where(holds, jnp.where(jnp.isfinite(values), values, _BIG), z.exceeding)
        cause = jnp.where(changed, _cause(exceeding, limits, reason), z.cause)
        law, fallback = self._continued(z, view._replace(r=place.pursued), laws, begins_again, broken)
        after = SupervisedState(
            law=(),
            fallback=(),
            gate=self.gate.after(view.passed, self._rate(z, view, u), elapsed),
            report=report,
            reference=view.given,
            place=place,
            allowance=allowance,
            conditions=conditions,
            state=state,
            reason=reason,
            cause=cause,
            exceeding=exceeding,
            time=time,
            safe_for=jnp.where(state == int(State.SAFE), z.safe_for + elapsed, 0.0),
            output=u,
            transfer=begins_again.astype(int),
            beyond=jnp.where(view.controls, view.beyond, 0.0),
            variation=variation,
            swings=swings,
            restarts=jnp.where(switches, _LONG_AGO, times),
            restarted=z.restarted + jnp.where(counted, 1, 0),
            fallback_controls=by_fallback.astype(int),
            request=z.request,
            log=logged(z.log, changed, (time, state, reason, cause[0], cause[1])),
        )
        after = jax.lax.cond(damaged, lambda: self._mended(after, z, y), lambda: after)
        return after._replace(law=law, fallback=fallback)

    def _mended(self, after: SupervisedState, z: SupervisedState, y: Measurement) -> SupervisedState:
        """The state without laws after damage to the memory: as at the start, but for what may not be forgotten.

        That is what the operator asked for, whether control was stopped, which conditions ask for SAFE, the place that
        is held, and the restarts, of which this is one.
        """
        none = AllowanceState(jnp.zeros(()), jnp.zeros(()))
        y = conceivable(y)
        new = self._fresh((), (), self.gate.init(y), y, none, _readable(after.reference))
        time, log = _readable(z.time) + self.sampling_time, _readable(z.log)
        stopped = z.state == int(State.STOPPED)
        state, reason = jnp.where(stopped, z.state, new.state), jnp.where(stopped, z.reason, code_of(MEMORY))
        new = new._replace(
            state=state,
            reason=reason,
            time=time,
            log=logged(log, jnp.asarray(True), (time, state, reason, *new.cause)),
            place=_readable(z.place),
            conditions=_readable(z.conditions),
            restarts=_with_restart(_readable(z.restarts, _LONG_AGO), time),
            restarted=z.restarted + 1,
            safe_for=_readable(z.safe_for),
            fallback_controls=z.fallback_controls,
            request=z.request,
        )
        return jax.tree.map(lambda fresh, old: fresh.astype(old.dtype), new, after)

    @property
    def takes_raw_readings(self) -> bool:
        """The gate judges them."""
        return True

    def known_acceleration(self, z: SupervisedState, y: Measurement, u_applied: Inputs) -> Outputs:
        return self.law.known_acceleration(z.law, y, u_applied)

    def signals(self):
        return self.law.signals() | SIGNALS

    def _view(self, z: SupervisedState, y: Measurement, r: Target) -> View:
        controls = _controls(z.state)
        y = conceivable(y)
        passed = self.gate.pass_through(z.gate, y, ~controls)
        reference, rejected = self._checked(z.reference, r)
        r = target(z.place, reference)
        y = passed.measurement
        by_law = lambda: self.law.command(z.law, y, r)
        if self.fallback is None:
            command, signals = by_law()
        else:
            command, signals = jax.lax.cond((z.fallback_controls > 0), lambda: self._by_fallback(z, y, r), by_law)
        largest_change = self.slew * (self.watch.high - self.watch.low) * self.sampling_time
        limited = jnp.clip(command, self.watch.low, self.watch.high)
        slewed = lambda goal: jnp.clip(goal, z.output - largest_change, z.output + largest_change)
        # The difference at a transfer ends by itself. Were the output led to that of the law instead, the law's loop
        # would have a slower actuator until then, and might never settle.
        beyond = jnp.where(z.transfer > 0, z.output - limited, z.beyond)
        beyond = jnp.where(jnp.isfinite(beyond), beyond - jnp.clip(beyond, -largest_change, largest_change), 0.0)
        output = jnp.where(beyond == 0, limited, limited + beyond)
        # Who holds or stops a vehicle that nothing is wrong with gets no jump either.
        safe = jnp.where(z.reason == code_of(OPERATOR), slewed(self.safe_output), self.safe_output)
        leaves = controls & jnp.isfinite(command).all()
        output = jnp.where(leaves, output, safe)
        # Whatever the memory holds.
        output = jnp.where(jnp.isfinite(output), jnp.clip(output, self.watch.low, self.watch.high), self.safe_output)
        return View(passed, reference, r, rejected, controls, command, signals, output, beyond)

    def _by_fallback(self, z: SupervisedState, y: Measurement, r: Target) -> tuple[Inputs, dict[str, Array]]:
        """Command of the fallback; of the signals those that it declares, too, the others are zero."""
        assert self.fallback is not None
        command, fallback_signals = self.fallback.command(z.fallback, y, r)
        _, declared = jax.eval_shape(self.law.command, z.law, y, r)
        alike = lambda name, form: name in fallback_signals and fallback_signals[name].shape == form.shape
        signals = {
            name: fallback_signals[name] if alike(name, form) else jnp.zeros(form.shape, form.dtype)
            for name, form in declared.items()
        }
        return command, signals

    def _checked(self, before: Target, r: Target) -> tuple[Target, Scalar]:
        """The reference, or the last valid one at rest; and the number of entries that cannot be used."""
        lengths = ~jnp.asarray(np.array(self.model.coordinates.angles))
        speed = jnp.where(lengths, self.gate.max_speed, self.gate.max_rate)
        implausible = jnp.abs(r.position) > jnp.where(lengths, self.gate.max_distance, _TURNS)
        implausible = implausible | (jnp.abs(r.velocity) > speed)
        implausible = implausible | (jnp.abs(r.acceleration) > speed / _SUDDEN)
        unusable = (~jnp.isfinite(jnp.stack(r))).sum(dtype=float) + implausible.sum(dtype=float)
        held = (before.position, jnp.zeros_like(before.velocity), jnp.zeros_like(before.acceleration))
        return Target(*(jnp.where(unusable > 0, valid, new) for valid, new in zip(held, r, strict=True))), unusable

    def _advanced(self, z: SupervisedState, view: View, u: Inputs, step: Scalar) -> tuple[PyTree, PyTree]:
        """States of law and fallback one step later; only the one that controls advances."""
        y, r = view.passed.measurement, view.r
        by_law = lambda: (self.law.advance(z.law, y, r, u, step), z.fallback)
        if (fallback := self.fallback) is None:
            return by_law()
        by_fallback = lambda: (z.law, fallback.advance(z.fallback, y, r, u, step))
        return jax.lax.cond((z.fallback_controls > 0), by_fallback, by_law)

    def _continued(self, z: SupervisedState, view: View, laws: tuple, begins_again, broken) -> tuple[PyTree, PyTree]:
        """States of law and fallback: begun again from the present measurement, advanced, or held."""
        y, r = view.passed.measurement, view.r

        def begun() -> tuple[PyTree, PyTree]:
            if self.fallback is None:
                return self.law.restarted(self._knowledge(z), y, r), ()
            return self.law.restarted(self._knowledge(z), y, r), self.fallback.restarted(self._knowledge(z), y, r)

        held = lambda: (z.law, z.fallback)
        goes_on = view.controls & ~broken & ~begins_again
        return jax.lax.cond(goes_on, lambda: laws, lambda: jax.lax.cond(begins_again, begun, held))

    def _knowledge(self, z: SupervisedState) -> PyTree:
        """What law and fallback know and must not lose: of the one that controls, where both know the same things."""
        of_law = _readable(self.law.knowledge(z.law))
        if self.fallback is None:
            return of_law
        of_fallback = _readable(self.fallback.knowledge(z.fallback))
        if jax.tree.structure(of_fallback) != jax.tree.structure(of_law):
            return of_law
        return jax.tree.map(lambda a, b: jnp.where((z.fallback_controls > 0), a, b), of_fallback, of_law)

    def _allowance(self, z: SupervisedState, view: View, elapsed: Scalar) -> AllowanceState:
        """Allowed tracking error; where nobody controls, it is the present one."""
        coordinates = self.model.coordinates
        present = self.tracking.start(coordinates, view.passed.measurement, view.r)
        targets = z.place.pursued, view.r
        later = self.tracking.after(z.allowance, coordinates, view.passed.measurement, targets, elapsed)
        return AllowanceState(*(jnp.where(view.controls, a, b) for a, b in zip(later, present, strict=True)))

    def _variation(self, z: SupervisedState, view: View, u: Inputs, step: Scalar) -> Scalar:
        """Average variation of the input, ranges from limit to limit per second."""
        variation = (jnp.abs(u - z.output) / (self.watch.high - self.watch.low)).mean() / step
        share = jnp.minimum(step / _AVERAGED, 1.0)
        settled = (z.transfer == 0) & (view.beyond == 0).all()
        return jnp.where(view.controls & settled, z.variation + share * (variation - z.variation), 0.0)

    def _jumped(self, conditions: Conditions) -> Bool[Array, ""]:
        """Whether readings that have jumped ask for SAFE, and a place has to be held for that."""
        level = jnp.stack([conditions.level[NUMBER[name]] for name in _MOVED]).max()
        return (level >= 2) & self.hold_after_jump

    def _tolerated(self, z: SupervisedState) -> Bool[Array, " conditions"]:
        """Conditions that do not lead to SAFE now: the law has failed, but there is a fallback."""
        row = jnp.arange(len(NAMES)) == NUMBER["restarts_exhausted"]
        return row & ~(z.fallback_controls > 0) & (self.fallback is not None)

    def _by_whom(self, z: SupervisedState, conditions: Conditions) -> Bool[Array, ""]:
        """Whether the fallback controls from now on: where the law has failed, or as the operator wants."""
        if self.fallback is None:
            return z.fallback_controls > 0
        failed = jnp.stack([conditions.level[NUMBER[name]] for name in ("restarts_exhausted", "chattering")]).max() > 0
        fails = (z.fallback_controls > 0) | (failed & _controls(z.state))
        requested = lambda request: z.request == int(request)
        return (fails | requested(Request.FALLBACK)) & ~requested(Request.LAW)

    def _next(self, z: SupervisedState, view: View, condition_state, reason) -> tuple[Int[Array, ""], Int[Array, ""]]:
        """State and reason of the next step, from what the conditions and the operator ask for."""
        code = lambda state: jnp.asarray(int(state))
        usable = (view.passed.not_finite == 0) & (view.passed.implausible <= 1)
        state = condition_state
        unknown = (z.state < int(State.INIT)) | (z.state > int(State.STOPPED))
        state = jnp.where(unknown, code(State.INIT), state)
        state = jnp.where(z.state == int(State.INIT), jnp.where(usable, code(State.READY), code(State.INIT)), state)
        state = jnp.where(z.safe_for > self.stop_after, code(State.STOPPED), state)
        hold = (z.request == int(Request.HOLD)) & _controls(state)
        stop = z.request == int(Request.STOP)
        state = jnp.where(hold, code(State.READY), jnp.where(stop, code(State.STOPPED), state))
        reason = jnp.where(hold | stop, code_of(OPERATOR), reason)
        stopped = z.state == int(State.STOPPED)
        return jnp.where(stopped, z.state, state), jnp.where(stopped, z.reason, reason)

    def _rate(self, z: SupervisedState, view: View, u: Inputs) -> Array:
        """Rate of the velocity by the model and the law's estimate of the uncertainty, m/s^2 and rad/s^2."""
        y = view.passed.measurement
        modelled = self.law.known_acceleration(z.law, y, u)
        acceleration = modelled
        if "estimate" in view.signals:
            # One that has diverged would make a jump of every reading.
            largest = _BELIEVED * jnp.minimum(self.gate.jump_velocity, self.gate.jump_rate) / self.sampling_time
            largest = jnp.minimum(largest, self.watch.max_estimate)
            acceleration = modelled + jnp.clip(view.signals["estimate"], -largest, largest)
        return rate_of_velocity(y, self.model.coordinates, acceleration)


def _readable(tree: PyTree, otherwise: float = 0.0) -> PyTree:
    """A tree with another number for what is not finite."""
    return jax.tree.map(lambda leaf: jnp.where(jnp.isfinite(leaf), leaf, jnp.full_like(leaf, otherwise)), tree)


def _with_restart(times: Array, time: Scalar) -> Array:
    """Times of the last restarts with one more."""
    return jnp.concatenate([time[None], times[:-1]])


def _controls(state: Int[Array, ""]) -> Bool[Array, ""]:
    """Whether the command of a law leaves in this state."""
    return (state == int(State.ACTIVE)) | (state == int(State.DEGRADED))


def _cause(values: PerCondition, limits: PerCondition, reason: Int[Array, ""]) -> Float[Array, "2"]:
    """Value and limit of the condition that is the reason."""
    row = jnp.arange(len(NAMES)) == reason - 1
    return jnp.stack([jnp.where(row, numbers, 0.0).sum() for numbers in (values, limits)])


def unsupervised(controller: AbstractController) -> AbstractController:
    """The law under supervision by itself; any other controller as it is."""
    if isinstance(controller, Supervised):
        controller = controller.law
    return controller.law if isinstance(controller, FaultTolerantController) else controller


def state_in(tree: PyTree) -> SupervisedState | None:
    """The state of a supervised controller somewhere in a tree; None where there is none."""
    is_state = lambda node: isinstance(node, SupervisedState)
    return next((leaf for leaf in jax.tree.leaves(tree, is_leaf=is_state) if is_state(leaf)), None)


def transfer(controller: AbstractController) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Limits of the input of a supervised controller, and its largest change in a step of a transfer."""
    supervised: Any = controller if isinstance(controller, Supervised) else getattr(controller, "law", controller)
    low, high = np.asarray(supervised.watch.low), np.asarray(supervised.watch.high)
    return low, high, np.asarray(supervised.slew * (high - low) * supervised.sampling_time)
