"""Detection and isolation of failed thrusters from the residual of an identification model."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import Inputs, Measurement, Model
from undertow.core.param import Param, param
from undertow.numerics.linear_algebra import inverse_symmetric, matvec

PerActuator = Float[Array, " m"]
PerAxis = Float[Array, " n"]

# Largest squared size of a residual, relative to its mean, with which it enters its covariance.
_CLIP = 9.0
# Steps after which the first residuals no longer decide the covariance, and its first value in squares of `unit`.
_FIRST, _START = 20.0, 25.0
# Force beyond the nominal one times 2.5 (a reversed thruster differs by 2) that a fault may have, as a share of the
# largest force; and the largest force of a failed thruster, as a multiple of the nominal largest one.
_SLACK, _EXCESS, _MOST = 0.05, 2.5, 1.3
# Share of the nominal force that is missing in D where a thruster is off: measured 0.55 to 0.85 from 0.1 to 0.5 s after
# the onset, because of the low-passes, the background and the motor. Above the second one, up to the third, it is
# reversed; below the first, part of the thrust is left.
_OFF_LEAST, _OFF_MOST, _REVERSED = 0.45, 0.95, 1.9
# Difference between reported and predicted force that is a fault: share of the largest force, and of the predicted one.
_REPORTED, _RELATIVE = 0.15, 0.3
# Time after which the inverse covariance is renewed, s.
_RENEWED = 0.1
# Largest change of the log-likelihood ratio by one independent residual, so that no single one decides.
_CHANGE = 20.0


class MonitorState(NamedTuple):
    """State of the monitor."""

    actuators: Any  # nominal ones, corrected by their report
    unreported: Any  # the same without the report; () where nothing is reported
    velocity: PerAxis  # p of the identification model, m/s, rad/s
    residual: PerAxis  # rho, m/s^2, rad/s^2
    background: PerAxis  # its slow part: loads and errors of the model
    covariance: Float[Array, "n n"]  # of the fast part without faults, in squares of `unit`
    inverse: Float[Array, "n n"]  # P, of the covariance and 1 in every direction, renewed from time to time
    size: PerActuator  # E_i . P E_i, likewise
    stale: Float[Array, ""]  # time until they are renewed, s
    forces: Float[Array, "3 m"]  # nominal forces behind one and two low-passes, and their slow part, N
    likelihood: PerActuator  # log-likelihood ratio of "off" to "healthy", of the last seconds
    suspected: PerActuator  # for how long each actuator has been suspected, s
    lost: PerActuator  # 1 for an actuator that has failed
    quiet: Float[Array, ""]  # time until an alarm is possible, s
    steps: Float[Array, ""]  # so far
    evidence: Float[Array, ""]  # that one actuator has failed, relative to the threshold


class ThrusterMonitor(eqx.Module):
    """Watches the acceleration that the model does not explain, for the direction of a single thruster.

    In body axes, with E the acceleration per force and f the forces of the applied input, p_dot = F + E f + rho with
    rho = w (nu - p) is the paper's series-parallel identification model, and rho is nu_dot - F - E f behind a low-pass
    of bandwidth w; a second one suppresses noise. A fault of thruster i adds E_i a_i. The fast part D of rho, without
    its slow background, is weighed by its own covariance without faults, which sea, noise and errors of the model
    raise: J_i = (E_i . P D)^2 / (E_i . P E_i), P the inverse covariance, is the part of D . P D that direction i
    explains, and a_i = E_i . P D / (E_i . P E_i) its force.

    Thruster i is suspected while J_i is above `threshold`^2 (`other_threshold`^2 unless a_i is that of a thruster that
    is off) and explains the share `explained` of D; the second best thruster explains `margin` less, and less than the
    share `rival` of it; and a_i is a force that a fault can have: against the nominal force, and not above the largest.
    A suspicion that persists is an alarm. Where actuators report their speed, one whose reported force differs from
    that predicted of its command is suspected as well.

    This finds a fault that begins while a thruster works. One that begins at little thrust, or a stuck propeller, shows
    by what does not happen afterwards: the fast part of the nominal force, phi, has no effect, D = -E_i phi_i. Its
    log-likelihood ratio to a healthy thruster, -2 phi_i E_i . P D - phi_i^2 E_i . P E_i per independent residual, is
    summed with fading memory (Page's cumulative sum, 1954); the thruster is suspected where it exceeds `likely` and
    that of every other by `clearly` and by the factor 1 / `likely_rival`.

    Raises:
        BadInput: a value that is not positive.
    """

    model: Model  # in body axes
    unit: Float[Param, " n"] = param("m/s^2, rad/s^2", "residual that is not worth attention")
    largest: Float[Param, " m"] = param("N", "largest force of each actuator")
    bandwidth: Float[Param, ""] = param("rad/s", "of each low-pass", symbol="w", default=15.0)
    background_time: Float[Param, ""] = param("s", "time constant of the slow part of the residual", default=0.7)
    memory: Float[Param, ""] = param("s", "time constant of the covariance", default=15.0)
    threshold: Float[Param, ""] = param("", "size of the residual that is a fault, in standard deviations", default=6.0)
    other_threshold: Float[Param, ""] = param("", "the same where the thruster is not simply off", default=8.0)
    learning: Float[Param, ""] = param(
        "s", "time from the start at which both thresholds are still doubled", default=4.0
    )
    explained: Float[Param, ""] = param("", "least share of the residual that one thruster explains", default=0.8)
    rival: Float[Param, ""] = param("", "largest share that the second best explains of that", default=0.9)
    margin: Float[Param, ""] = param("", "least squared distance to the second best, in variances", default=12.0)
    least: Float[Param, ""] = param("", "smallest force of a fault, as a share of the largest force", default=0.08)
    likely: Float[Param, ""] = param("", "log-likelihood ratio that is a fault", default=50.0)
    clearly: Float[Param, ""] = param("", "by which it exceeds that of the second best", default=30.0)
    likely_rival: Float[Param, ""] = param("", "largest ratio of the second best to the best", default=0.7)
    correlation: Float[Param, ""] = param("s", "after which residuals are independent", default=0.3)
    fading: Float[Param, ""] = param("s", "time constant with which the sum fades", default=4.0)
    persistence: Float[Param, ""] = param("s", "for which a suspicion persists before it is an alarm", default=0.05)
    settling: Float[Param, ""] = param("s", "after the start, without alarms", default=2.0)
    pause: Float[Param, ""] = param("s", "after an alarm, without another", default=0.3)

    def __check_init__(self):
        for name in (
            *("unit", "largest", "bandwidth", "background_time", "memory", "threshold", "explained", "rival"),
            *("likely", "likely_rival", "correlation", "fading"),
        ):
            checks.positive(name, getattr(self, name))
        for name in ("margin", "least", "other_threshold", "learning", "clearly", "persistence", "settling", "pause"):
            checks.not_negative(name, getattr(self, name))

    def init(self, y: Measurement) -> MonitorState:
        """State before the first step: nothing is lost."""
        actuators, zero, none = self.model.actuators.init(), jnp.zeros(()), jnp.zeros_like(self.largest)
        velocity = self.model.coordinates.velocity(y)
        return MonitorState(
            actuators=actuators,
            unreported=() if y.actuator is None else actuators,
            velocity=velocity,
            residual=jnp.zeros_like(velocity),
            background=jnp.zeros_like(velocity),
            covariance=_START * jnp.eye(velocity.shape[0]),
            inverse=jnp.eye(velocity.shape[0]) / (_START + 1),
            size=jnp.ones_like(none),
            stale=zero,
            forces=jnp.zeros((3, *none.shape)),
            likelihood=none,
            suspected=none,
            lost=none,
            quiet=self.settling,
            steps=zero,
            evidence=zero,
        )

    def advance(self, state: MonitorState, y: Measurement, u_applied: Inputs, used: PerActuator, dt) -> MonitorState:
        """State one sampling time later; what is lost stays lost.

        Args:
            state: now.
            y: measurement of now.
            u_applied: input, held until then.
            used: 1 for an actuator that is in use, else 0.
            dt: sampling time, s.
        """
        share, slow = -jnp.expm1(-self.bandwidth * dt), -jnp.expm1(-dt / self.background_time)
        dynamics = self.model.dynamics
        after, force, unreported, differs = self._forces(state, y, u_applied, dt)
        away = self.model.coordinates.velocity(y) - state.velocity
        away = jnp.where(jnp.isfinite(away), away, 0.0)
        effect = dynamics.gain(y)
        residual = state.residual + share * (share / dt * away - state.residual)
        second = state.forces[1] + share * (state.forces[0] - state.forces[1])
        first = state.forces[0] + share * (force - state.forces[0])

        fast = (residual - state.background) / self.unit
        inverse, size = self._renewed(state, effect)
        pulled = matvec(inverse, fast)
        weighed = _Weighed(matvec(effect.T, pulled / self.unit), size, (fast * pulled).sum())
        raised_by = 1 + self.learning / ((state.steps + 1) * dt)  # while the covariance is that of a short time
        found, explained = self._isolated(weighed, second, used, raised_by)
        likelihood, likely = self._accumulated(state, weighed, second, used, dt)
        suspicious = jnp.where(state.quiet > 0, 0.0, jnp.maximum(jnp.maximum(found, likely), differs) * used)
        suspected = jnp.where(suspicious > 0, state.suspected + dt, jnp.maximum(state.suspected - dt, 0.0))
        alarm = (suspected >= self.persistence) & (suspected >= suspected.max()) & (used > 0)
        raised = alarm.any()
        # What the alarm explains is no longer news: the rest may be the next fault.
        known = matvec(effect, jnp.where(alarm, weighed.along / weighed.size, 0.0))
        steady = jnp.maximum(dt / self.memory, 1 / (state.steps + _FIRST))
        weight = steady * jnp.minimum(1.0, _CLIP * fast.shape[0] / jnp.where(weighed.total > 0, weighed.total, 1.0))
        return MonitorState(
            actuators=after,
            unreported=unreported,
            velocity=state.velocity + dt * (dynamics.drift(y) + matvec(effect, force)) + share * away,
            residual=residual,
            background=state.background + slow * (residual - state.background) + known,
            covariance=state.covariance * (1 - steady) + weight * fast[:, None] * fast[None, :],
            inverse=inverse,
            size=size,
            stale=jnp.where(state.stale > 0, state.stale - dt, _RENEWED),
            forces=jnp.stack([first, second, state.forces[2] + slow * (second - state.forces[2])]),
            likelihood=likelihood,
            suspected=jnp.where(raised, 0.0, suspected),
            lost=jnp.where(alarm, 1.0, state.lost),
            quiet=jnp.where(raised, self.pause, jnp.maximum(state.quiet - dt, 0.0)),
            steps=state.steps + 1,
            evidence=jnp.maximum(jnp.sqrt(explained) / self.threshold, likelihood.max() / self.likely),
        )

    def _forces(self, state: MonitorState, y: Measurement, u_applied: Inputs, dt):
        """Actuators one step later, their mean force, the same actuators without report, and 1 where both differ."""
        model = self.model.actuators
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

    def _renewed(self, state: MonitorState, effect: Float[Array, "n m"]):
        """P and E_i . P E_i, which change slowly and are renewed every tenth of a second."""

        def renewed():
            scaled = effect / self.unit[:, None]
            inverse = inverse_symmetric(state.covariance + jnp.eye(effect.shape[0]))
            size = (scaled * (inverse[:, :, None] * scaled[None, :, :]).sum(1)).sum(0)
            return inverse, jnp.where(size > 0, size, 1.0)

        return jax.lax.cond(state.stale > 0, lambda: (state.inverse, state.size), renewed)

    def _isolated(self, weighed: "_Weighed", forces: PerActuator, used: PerActuator, raised_by: Float[Array, ""]):
        """1 for the actuator whose force explains the residual as a fault can, else 0; and J of the best."""
        along, size, total = weighed
        force, explained = along / size, along * along / size
        possible = (force * forces < 0) & (jnp.abs(force) < _EXCESS * jnp.abs(forces) + _SLACK * self.largest)
        explained = jnp.where(possible | (used < 1), explained, 0.0)
        best = explained.max()
        is_best = explained >= best
        second = jnp.where(is_best, 0.0, explained).max()
        missing = -force * jnp.sign(forces)
        nominal = jnp.abs(forces)
        off = (missing > _OFF_LEAST * nominal) & (missing < _OFF_MOST * nominal)
        needed = raised_by * jnp.where(off, self.threshold, self.other_threshold)
        clear = (
            (best > needed**2)
            & (missing < _REVERSED * nominal)
            & (best > self.explained * total)
            & (second < self.rival * best)
            & (second < best - self.margin)
        )
        believable = (jnp.abs(force) > self.least * self.largest) & (jnp.abs(forces + force) < _MOST * self.largest)
        return jnp.where(is_best & believable & clear, 1.0, 0.0), best

    def _accumulated(self, state: MonitorState, weighed: "_Weighed", forces: PerActuator, used: PerActuator, dt):
        """Log-likelihood ratios one step later, and 1 for an actuator whose ratio stands out, else 0."""
        fast = forces - state.forces[2]
        change = -2 * fast * weighed.along - fast * fast * weighed.size
        change = jnp.clip(change, -_CHANGE, _CHANGE) * (dt / self.correlation)
        summed = jnp.maximum(state.likelihood * (1 - dt / self.fading) + change, 0.0)
        summed = jnp.where((used > 0) & (state.quiet <= 0), summed, 0.0)
        best = summed.max()
        is_best = summed >= best
        second = jnp.where(is_best, 0.0, summed).max()
        clear = (best > self.likely) & (second < best - self.clearly) & (second < self.likely_rival * best)
        return summed, jnp.where(is_best & clear, 1.0, 0.0)


class _Weighed(NamedTuple):
    """Residual and thrusters weighed by the inverse covariance P, in squares of `unit`."""

    along: PerActuator  # E_i . P D
    size: PerActuator  # E_i . P E_i
    total: Float[Array, ""]  # D . P D
