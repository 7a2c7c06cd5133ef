"""Detection and isolation of failed thrusters from the residual of an identification model."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.supervision.fault_hypotheses import FaultThresholds, missing_effect, one_thruster, two_thrusters
from undertow.control.supervision.fault_onset import (
    OnsetState,
    cleared,
    examine,
    first_weight,
    onset_state,
    transients,
    weighed,
    wide_covariance,
    wide_difference,
)
from undertow.control.supervision.gradual_onset import (
    GRADUAL_ONSETS,
    RARELY,
    Series,
    examine_next,
    gradual_bounds,
    gradual_state,
)
from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import Inputs, Measurement, Model
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param

PerActuator = Float[Array, " m"]
PerAxis = Float[Array, " n"]

# First value of the covariance of the residual without its background, in squares of `unit`, the residuals that it
# counts for, and the largest squared size of one, relative to its mean, with which it enters.
_START, _FIRST, _CLIP = 25.0, 4.0, 9.0
# Part of the change of the nominal force of an unused thruster that its direction is not trusted to show.
_UNUSED = 2.0
# Difference between reported and predicted force that is a fault: share of the largest force, and of the predicted one.
_REPORTED, _RELATIVE = 0.15, 0.3
# Share of the largest force to which a law drives thrusters whose effect is missing, without success.
_STRAINED = 0.9
# Largest change of the log-likelihood ratio by one independent residual, so that no single one decides.
_CHANGE = 20.0


class ThrusterMonitorState(NamedTuple):
    """What the examinations keep."""

    onsets: OnsetState
    wide_covariance: Float[Array, "n n"]  # of the wide difference without faults, in squares of `unit`
    background: PerAxis  # slow part of the residual: loads and errors of the model, m/s^2, rad/s^2
    slow_forces: PerActuator  # slow part of the nominal forces, N
    slow_covariance: Float[Array, "n n"]  # of the residual without its background, in squares of `unit`
    likelihood: Float[Array, "m m"]  # log-likelihood ratios of "off" to "healthy", of the last seconds; pairs beside
    suspected: PerActuator  # for how long each actuator has been suspected, s
    in_pair: PerActuator  # for how long each has been suspected together with another, s
    lost: PerActuator  # 1 for an actuator that has failed
    quiet: Float[Array, ""]  # time until an alarm is possible, s
    examinations: Float[Array, ""]  # examinations so far
    evidence: Float[Array, ""]  # that one actuator has failed, relative to the threshold


class MonitorState(NamedTuple):
    """State of the monitor."""

    actuators: Any  # nominal ones, corrected by their report
    unreported: Any  # the same without the report; () where nothing is reported
    velocity: PerAxis  # p of the identification model, m/s, rad/s
    residual: PerAxis  # rho behind the second low-pass, m/s^2, rad/s^2
    forces: Float[Array, "2 m"]  # nominal forces behind one and two low-passes, N
    wait: Float[Array, ""]  # time until the next examination, s
    findings: ThrusterMonitorState
    gradual: Series  # what is known of gradual onsets

    @property
    def lost(self) -> PerActuator:
        """1 for an actuator that has failed."""
        return self.findings.lost

    @property
    def evidence(self) -> Float[Array, ""]:
        """Evidence that one actuator has failed, relative to the threshold."""
        return self.findings.evidence


class ThrusterMonitor(eqx.Module):
    """Watches the acceleration that the model does not explain, for the directions of failed thrusters.

    In body axes, with E the acceleration per force and f the forces of the applied input, p_dot = F + E f + rho with
    rho = w (nu - p) is the paper's series-parallel identification model, and rho is nu_dot - F - E f behind a low-pass
    of bandwidth w; a second one suppresses noise. A fault of thruster i adds E_i a_i.

    Every `interval` the residual is examined (`fault_onset`). Its second difference e is what a linear extrapolation
    does not predict: loads, waves and errors of the model change slowly and almost disappear in it. e is weighed by its
    own covariance without faults, which sea, noise and errors of the model raise, and by what errors of the thruster
    model add to it when forces change (`mismatch`).

    A thruster is suspected where it explains the innovations since one of the last ten examinations as one that is off
    does, but for a factor: `fault_hypotheses.one_thruster`. It must explain `threshold`^2, and more than every other
    thruster by `margin`. Two thrusters are suspected where both are off and explain what no single one does. A
    suspicion that persists is an alarm. Where actuators report their speed, one whose reported force differs from that
    predicted of its command is suspected as well.

    The same examination at a sixth of the rate, with a smaller `unit` and a smaller `least` force, finds what is too
    slow for the first one: a propeller that coasts, or a small force that a law of low bandwidth raises over seconds.
    Two series of such examinations take turns.

    This finds a fault that begins while a thruster works. One that begins at little thrust, or a stuck propeller, shows
    by what does not happen afterwards: the nominal force without its slow part, phi, has no effect on the residual
    without its slow part (`background_time`), which is then D = -E_i phi_i, weighed by a covariance of its own.
    Its log-likelihood ratio to a healthy thruster, -2 phi_i E_i . P D - phi_i^2 E_i . P E_i per independent residual,
    is summed with fading memory (Page's cumulative sum, 1954); the thruster is suspected where it exceeds `likely` and
    that of every other by `clearly` and by the factor 1 / `likely_rival`. The same ratio of a pair, with the effect of
    both missing and D the wide difference of `fault_onset`, finds two thrusters that stopped at once at little thrust,
    where no single one explains what follows.

    Raises:
        BadInput: a value that is not positive.
    """

    unit: Float[Param, " n"] = param("m/s^2, rad/s^2", "residual that is not worth attention")
    largest: Float[Param, " m"] = param("N", "largest force of each actuator")
    bandwidth: Float[Param, ""] = param("rad/s", "of each low-pass", symbol="w", default=15.0)
    interval: Float[Param, ""] = param("s", "between two examinations, at least the sampling time", default=0.05)
    background_time: Float[Param, ""] = param("s", "time constant of the slow part of the residual", default=0.7)
    memory: Float[Param, ""] = param("s", "time constant of the covariance", default=15.0)
    mismatch: Float[Param, ""] = param("", "share of a change of force that the model may miss", default=0.06)
    decay: Float[Param, ""] = param("s", "time constant with which the thrust of a failed thruster ends", default=0.06)
    threshold: Float[Param, ""] = param(
        "", "size of the residuals that is a fault, in standard deviations", default=5.0
    )
    learning: Float[Param, ""] = param("s", "time from the start at which the threshold is still doubled", default=1.0)
    margin: Float[Param, ""] = param("", "least squared distance to the second best, in variances", default=12.0)
    least: Float[Param, ""] = param("", "smallest force of a fault, as a share of the largest force", default=0.08)
    likely: Float[Param, ""] = param("", "log-likelihood ratio that is a fault", default=50.0)
    clearly: Float[Param, ""] = param("", "by which it exceeds that of the second best", default=30.0)
    likely_rival: Float[Param, ""] = param("", "largest ratio of the second best to the best", default=0.7)
    correlation: Float[Param, ""] = param("s", "after which residuals are independent", default=0.3)
    fading: Float[Param, ""] = param("s", "time constant with which the sum fades", default=4.0)
    gradual_threshold: Float[Param, ""] = param("", "`threshold` of gradual onsets", default=6.0)
    gradual_unit: Float[Param, ""] = param("", "`unit` of gradual onsets, as a share of it", default=0.25)
    gradual_least: Float[Param, ""] = param("", "`least` of gradual onsets", default=0.005)
    gradual_decay: Float[Param, ""] = param("s", "`decay` of gradual onsets: a coasting propeller", default=0.15)
    gradual_persistence: Float[Param, ""] = param("s", "`persistence` of gradual onsets", default=0.4)
    persistence: Float[Param, ""] = param("s", "for which a suspicion persists before it is an alarm", default=0.05)
    settling: Float[Param, ""] = param("s", "after the start, without alarms", default=2.0)
    pause: Float[Param, ""] = param("s", "after an alarm, without another", default=0.3)

    def __check_init__(self):
        for name in (
            *("unit", "largest", "bandwidth", "interval", "background_time", "memory", "threshold", "decay"),
            *("likely", "likely_rival", "correlation", "fading", "gradual_threshold", "gradual_unit", "gradual_decay"),
        ):
            checks.positive(name, getattr(self, name))
        for name in (
            *("margin", "least", "learning", "clearly", "persistence", "settling", "pause", "mismatch"),
            *("gradual_least", "gradual_persistence"),
        ):
            checks.not_negative(name, getattr(self, name))

    def init(self, model: Model, y: Measurement) -> MonitorState:
        """State before the first step: nothing is lost.

        Args:
            model: nominal, in body axes.
            y: measurement of now.
        """
        actuators, zero, none = model.actuators.init(), jnp.zeros(()), jnp.zeros_like(self.largest)
        velocity = model.coordinates.velocity(y)
        axes, count = velocity.shape[0], none.shape[0]
        findings = ThrusterMonitorState(
            onsets=onset_state(axes, count),
            wide_covariance=wide_covariance(axes),
            background=jnp.zeros_like(velocity),
            slow_forces=none,
            slow_covariance=_START * jnp.eye(axes),
            likelihood=jnp.zeros((count, count)),
            suspected=none,
            in_pair=none,
            lost=none,
            quiet=self.settling,
            examinations=zero,
            evidence=zero,
        )
        return MonitorState(
            actuators=actuators,
            unreported=() if y.actuator is None else actuators,
            velocity=velocity,
            residual=jnp.zeros_like(velocity),
            forces=jnp.zeros((2, *none.shape)),
            wait=zero,
            findings=findings,
            gradual=gradual_state(axes, count),
        )

    def advance(
        self, state: MonitorState, model: Model, y: Measurement, u_applied: Inputs, used: PerActuator, dt
    ) -> MonitorState:
        """State one sampling time later; what is lost stays lost.

        Args:
            state: now.
            model: nominal, in body axes. That of the law, so that what both compute of it is computed once.
            y: measurement of now.
            u_applied: input, held until then.
            used: 1 for an actuator that is in use, else 0.
            dt: sampling time, s.
        """
        share = -jnp.expm1(-self.bandwidth * dt)
        dynamics = model.dynamics
        after, force, unreported, differs = self._forces(state, model.actuators, y, u_applied, dt)
        away = model.coordinates.velocity(y) - state.velocity
        away = jnp.where(jnp.isfinite(away), away, 0.0)
        effect = dynamics.gain(y)
        residual = state.residual + share * (share / dt * away - state.residual)
        second = state.forces[1] + share * (state.forces[0] - state.forces[1])
        first = state.forces[0] + share * (force - state.forces[0])
        velocity = state.velocity + dt * (dynamics.drift(y) + matvec(effect, force)) + share * away
        elapsed = dt * jnp.maximum(jnp.round(self.interval / dt), 1.0)  # whole sampling times
        forces, is_time, past = jnp.stack([second, first, force]), state.wait < dt / 2, state.findings
        # Beside the other examination, not inside it: a branch within a branch is traced several times.
        gradual = jax.lax.cond(
            is_time & (jnp.mod(past.examinations, RARELY / 2) == 0),
            lambda: self._examined_rarely(state.gradual, past, effect, residual, second, used, elapsed),
            lambda: state.gradual,
        )
        findings = jax.lax.cond(
            is_time,
            lambda: self._examined(past, gradual, effect, residual, forces, differs, used, elapsed),
            lambda: past,
        )
        raised = (findings.lost > past.lost).any()
        return MonitorState(
            actuators=after,
            unreported=unreported,
            velocity=jnp.where(jnp.isfinite(velocity), velocity, state.velocity),
            residual=residual,
            forces=jnp.stack([first, second]),
            wait=jnp.where(is_time, elapsed, state.wait) - dt,
            findings=findings,
            gradual=(gradual[0].without_sums(raised), gradual[1].without_sums(raised)),
        )

    def _examined(
        self,
        past: ThrusterMonitorState,
        gradual: Series,
        effect: Float[Array, "n m"],
        residual: PerAxis,
        forces: Float[Array, "3 m"],
        differs: PerActuator,
        used: PerActuator,
        elapsed: Float[Array, ""],
    ) -> ThrusterMonitorState:
        """Findings with one more residual.

        Args:
            past: findings until now.
            gradual: what is known of gradual onsets.
            effect: acceleration per force.
            residual: of now, m/s^2, rad/s^2.
            forces: nominal ones behind two, one and no low-pass, N.
            differs: 1 for an actuator whose report differs from its command, else 0.
            used: 1 for an actuator that is in use, else 0.
            elapsed: time since the examination before, s.
        """
        scaled = effect / self.unit[:, None]
        error_share = jnp.where(used > 0, self.mismatch, _UNUSED)
        remains = transients(self.bandwidth, self.decay, elapsed)
        learned = first_weight(past.examinations, elapsed, self.memory)
        scaled_residual = residual / self.unit
        onsets, missing = examine(past.onsets, scaled_residual, forces, scaled, error_share, remains, learned)
        wide, covariance_of_wide = wide_difference(
            past.onsets, past.wide_covariance, scaled_residual, forces[0], scaled, error_share, learned
        )
        since = jnp.maximum(past.examinations, 1.0) * elapsed  # while it is short, the covariance is not well known
        bounds = FaultThresholds(
            ((1 + self.learning / since) * self.threshold) ** 2, jnp.asarray(self.margin), self.least * self.largest
        )
        awake = past.quiet <= 0
        suspect, explained = one_thruster(onsets, missing, used, bounds)
        at_once = jnp.sqrt(explained) / self.threshold
        filtered_forces = forces[0]
        slow = (residual - past.background) / self.unit
        weighed_slow = weighed(scaled, past.slow_covariance + jnp.eye(len(slow)), slow)
        diagonal = jnp.eye(len(used)) > 0
        ratio_of_single = missing_effect(weighed_slow, filtered_forces - past.slow_forces)
        ratio_of_pair = missing_effect(wide.weighed, wide.changes)
        ratio = jnp.where(diagonal, ratio_of_single, ratio_of_pair)
        likelihood, likely, likely_pair = self._accumulated(past, ratio, used, elapsed)
        strained = jnp.where(jnp.abs(filtered_forces) > _STRAINED * self.largest, likely_pair, 0.0)
        suspicious = jnp.where(awake, jnp.maximum(jnp.maximum(suspect, likely), differs) * used, 0.0)
        suspected = jnp.where(suspicious > 0, past.suspected + elapsed, jnp.maximum(past.suspected - elapsed, 0.0))
        alarm = (suspected > self.persistence) & (suspected >= suspected.max()) & (used > 0)
        pair = two_thrusters(wide, filtered_forces, used, bounds)
        pair = jnp.where(awake, jnp.where(pair.max() > 0, pair, strained), 0.0)
        in_pair = jnp.where(pair > 0, past.in_pair + elapsed, 0.0)
        pair_alarm = (in_pair > self.persistence) & (((in_pair > self.persistence) & (pair > 0)).sum() > 1)
        alarm = jnp.where(alarm.any(), alarm, pair_alarm)
        longest = jnp.maximum(gradual[0].suspected, gradual[1].suspected)
        gradual_alarm = (longest > self.gradual_persistence) & (longest >= longest.max())
        alarm = jnp.where(alarm.any(), alarm, gradual_alarm & (used > 0) & awake)
        raised = alarm.any()
        forgotten = -jnp.expm1(-elapsed / self.background_time)
        steady = jnp.maximum(elapsed / self.memory, 1 / (past.examinations + _FIRST))
        weight = steady * jnp.minimum(
            1.0, _CLIP * len(slow) / jnp.where(weighed_slow.total > 0, weighed_slow.total, 1.0)
        )
        return ThrusterMonitorState(
            onsets=cleared(onsets, raised),
            wide_covariance=covariance_of_wide,
            background=past.background + forgotten * (residual - past.background),
            slow_forces=past.slow_forces + forgotten * (filtered_forces - past.slow_forces),
            slow_covariance=past.slow_covariance * (1 - steady) + weight * slow[:, None] * slow[None, :],
            likelihood=likelihood,
            suspected=jnp.where(raised, 0.0, suspected),
            in_pair=jnp.where(raised, 0.0, in_pair),
            lost=jnp.where(alarm, 1.0, past.lost),
            quiet=jnp.where(raised, self.pause, jnp.maximum(past.quiet - elapsed, 0.0)),
            examinations=past.examinations + 1,
            evidence=jnp.maximum(
                jnp.maximum(at_once, likelihood.max() / self.likely),
                jnp.maximum(gradual[0].evidence, gradual[1].evidence),
            ),
        )

    def _examined_rarely(
        self,
        series: Series,
        past: ThrusterMonitorState,
        effect: Float[Array, "n m"],
        residual: PerAxis,
        forces: PerActuator,
        used: PerActuator,
        elapsed: Float[Array, ""],
    ) -> Series:
        """What is known of gradual onsets with one more residual.

        Args:
            series: until now.
            forces: nominal ones behind two low-passes, N.
            past, effect, residual, used, elapsed: as in `_examined`.
        """
        unit, elapsed_rarely = self.gradual_unit * self.unit, RARELY * elapsed
        since = jnp.maximum(past.examinations, 1.0) * elapsed
        square = ((1 + self.learning / since) * self.gradual_threshold) ** 2
        of_series = jnp.floor((past.examinations + 1) / RARELY)  # + 1: whatever the rounding of the quotient
        return examine_next(
            series,
            residual / unit,
            forces,
            effect / unit[:, None],
            jnp.where(used > 0, self.mismatch, _UNUSED),
            transients(self.bandwidth, self.gradual_decay, elapsed_rarely, GRADUAL_ONSETS),
            first_weight(of_series, elapsed_rarely, self.memory),
            jnp.where(past.quiet <= 0, used, 0.0),
            gradual_bounds(square, jnp.asarray(self.margin), self.gradual_least * self.largest),
            elapsed_rarely,
        )

    def _forces(self, state: MonitorState, model: AbstractActuatorModel, y: Measurement, u_applied: Inputs, dt):
        """Actuators one step later, their mean force, the same actuators without report, and 1 where both differ."""
        reported = model.update_from_report(state.actuators, y.actuator)
        after = model.advance(reported, u_applied, dt)
        before = model.force(reported, u_applied)
        force = jnp.broadcast_to((before + model.force(after, u_applied)) / 2, self.largest.shape)
        if y.actuator is None or (isinstance(state.unreported, tuple) and not state.unreported):
            return after, force, state.unreported, jnp.zeros_like(self.largest)
        predicted = model.force(state.unreported, u_applied)
        allowed = _REPORTED * self.largest + _RELATIVE * jnp.abs(predicted)
        differs = jnp.where(jnp.abs(before - predicted) > allowed, 1.0, 0.0)
        return after, force, model.advance(state.unreported, u_applied, dt), differs

    def _accumulated(self, past: ThrusterMonitorState, ratio: Float[Array, "m m"], used: PerActuator, elapsed):
        """Log-likelihood ratios one examination later, and 1 for the actuator, and for the pair, that stands out."""
        ratio = jnp.clip(ratio, -_CHANGE, _CHANGE) * (elapsed / self.correlation)
        summed = jnp.maximum(past.likelihood * (1 - elapsed / self.fading) + ratio, 0.0)
        in_use = jnp.where((used > 0) & (past.quiet <= 0), 1.0, 0.0)
        summed = summed * in_use[:, None] * in_use[None, :]
        identity = jnp.eye(len(used))
        single, pair = (summed * identity).max(1), summed * jnp.triu(jnp.ones_like(identity), 1)
        best, best_pair = single.max(), pair.max()
        is_best, is_best_pair = single >= best, (pair >= best_pair) & (best_pair > 0)
        second = jnp.where(is_best, 0.0, single).max()
        second_pair = jnp.maximum(jnp.where(is_best_pair, 0.0, pair).max(), best)
        clear = (best > self.likely) & (second < best - self.clearly) & (second < self.likely_rival * best)
        clear_pair = (best_pair > self.likely) & (second_pair < self.likely_rival * best_pair)
        in_pair = jnp.where(is_best_pair & clear_pair, 1.0, 0.0)
        return summed, jnp.where(is_best & clear, 1.0, 0.0), jnp.maximum(in_pair.max(0), in_pair.max(1))
