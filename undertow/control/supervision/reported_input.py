"""Whether the input that is reported as applied is the one that moves the plant, or the command is.

A driver that reports another input than it applies makes every part that knows the applied input wrong: the law's
estimate, the prediction of readings, the search for lost thrusters. Of two hypotheses, that the report is true and that
the command is applied whatever is reported, each explains the motion by the nominal model up to an error. The sum of
their log-likelihood ratio, Wald's sequential test with a sum that never falls below zero and fades, says when the
report cannot be true.

Thrusters that work against each other move nothing, so that no motion contradicts a report that is wrong about them. A
true report follows the command, at least in part: one that stands still while the command changes counts as wrong, too.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import Inputs, Measurement, Model
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param

# A report follows if its changes are this share of those of the command or more: speed controllers may be slow.
_FOLLOWS = 0.25

# Share of the range of an input below which a report says that nothing is applied, as of a vehicle that is disarmed.
_NOTHING = 0.01

Scalar = Float[Array, ""]
PerAxis = Float[Array, " n"]


class ReportState(NamedTuple):
    """What is known of the report."""

    predicted: PerAxis  # velocity by the model with the reported input, m/s and rad/s
    residual: PerAxis  # velocity that this prediction misses, of the last time
    difference: PerAxis  # velocity that the reported input adds to that by the command, of the last time
    likelihood: Scalar  # log-likelihood ratio for the command
    reported: Inputs  # last input that was reported
    command: Inputs  # the same as commanded
    unfollowed: Scalar  # changes of the command that the report did not follow, ranges, mean of the inputs


class ReportedInput(eqx.Module):
    """The test, and how much the nominal model may be wrong. Axes that no actuator moves tell nothing.

    Raises:
        BadInput: a number is not positive, or the authority is negative.
    """

    authority: Float[Param, " n"] = param("m/s^2 or rad/s^2", "largest acceleration of the actuators, of each axis")
    input_range: Float[Param, " m"] = param("unit of the input", "from the lower to the upper limit of each input")
    mismatch: Float[Param, ""] = param("", "share of it that the nominal model may miss", default=0.1)
    memory: Float[Param, ""] = param("s", "over which velocities are compared", default=0.5)
    fading: Float[Param, ""] = param("s", "in which the likelihood is forgotten", default=2.0)
    threshold: Float[Param, ""] = param("", "log-likelihood ratio from which on the report is wrong", default=4.0)
    most_unfollowed: Float[Param, ""] = param("", "changes that a report may not follow, ranges", default=1.0)

    def __check_init__(self):
        checks.not_negative("authority", self.authority, finite=False)
        checks.positive("input_range", self.input_range, finite=False)
        for name in ("mismatch", "memory", "fading", "threshold", "most_unfollowed"):
            checks.positive(name, getattr(self, name))

    def init(self, model: Model, y: Measurement, u: Inputs) -> ReportState:
        """State at a measurement, with an input that is reported and commanded."""
        velocity = model.coordinates.velocity(y)
        velocity = jnp.where(jnp.isfinite(velocity), velocity, 0.0)
        none = jnp.zeros(())
        return ReportState(velocity, jnp.zeros_like(velocity), jnp.zeros_like(velocity), none, u, u, none)

    def after(
        self, state: ReportState, model: Model, y: Measurement, reported: Inputs, command: Inputs, dt: Scalar
    ) -> ReportState:
        """State with one more measurement.

        Args:
            state: before.
            model: nominal.
            y: measurement of now, which the gate has let through.
            reported: input from now on, as it is reported.
            command: the same as commanded.
            dt: time from now on, s.
        """
        velocity, dynamics = model.coordinates.velocity(y), model.dynamics
        decay = jnp.exp(-dt / self.memory)
        residual = decay * (state.residual + velocity - state.predicted)
        missed = jnp.where(self.authority > 0, self.mismatch * self.authority * self.memory, jnp.inf)  # m/s, rad/s
        ratio = ((-2 * residual - state.difference) * state.difference / missed**2).sum() / 2
        largest_likelihood = 2 * self.threshold
        likelihood = (1 - dt / self.fading) * state.likelihood + dt / self.memory * ratio
        likelihood = jnp.clip(likelihood, 0.0, largest_likelihood)
        actuators, effect = model.actuators.quasi_static(), dynamics.gain(y)
        forces = lambda u: actuators.force(actuators.init(), u)
        by_report = matvec(effect, forces(reported))
        difference = by_report - matvec(effect, forces(command))
        return ReportState(
            predicted=velocity + dt * (dynamics.drift(y) + by_report),
            residual=residual,
            difference=decay * (state.difference + dt * difference),
            likelihood=likelihood,
            reported=reported,
            command=command,
            unfollowed=self._unfollowed(state, reported, command),
        )

    def _unfollowed(self, state: ReportState, reported: Inputs, command: Inputs) -> Scalar:
        """Changes of the command that the report did not follow, ranges."""
        change = lambda now, before: (jnp.abs(now - before) / self.input_range).mean()
        missing = change(command, state.command) - change(reported, state.reported) / _FOLLOWS
        nothing = (jnp.abs(reported) <= _NOTHING * self.input_range).all()
        return jnp.where(nothing, 0.0, jnp.clip(state.unfollowed + missing, 0.0, 2 * self.most_unfollowed))

    def contradicted(self, state: ReportState) -> Scalar:
        """How wrong the report is: its log-likelihood ratio, or what it did not follow, relative to its threshold."""
        return jnp.maximum(state.likelihood / self.threshold, state.unfollowed / self.most_unfollowed)
