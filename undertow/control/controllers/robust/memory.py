"""Memory of the lumped uncertainty along the reference: fuzzy rules or a linear regressor, learnt while controlling.

A disturbance observer follows the uncertainty with the lag of its bandwidth, each time as if for the first time. The
memory is a map from the motion of the reference to the uncertainty. It is evaluated without lag and without noise.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.robust import evidence
from undertow.control.controllers.robust.evidence import Evidence
from undertow.control.controllers.robust.inertia import InertiaIdentification, InertiaState
from undertow.control.controllers.robust.knowledge import Knowledge
from undertow.control.estimation.fuzzy_system import FuzzySystem, gaussian_sets
from undertow.core import checks
from undertow.core.contracts import Measurement, TrackingError
from undertow.core.errors import BadInput
from undertow.core.measurement import body_of
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import cross
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]
Regressor = Float[Array, " k"]

REGRESSORS = ("both", "rules", "linear")


class MemoryState(NamedTuple):
    """What is remembered, how uncertain it is, and the regressor behind the observer's lag."""

    weights: Float[Array, "k n"]  # m/s^2, rad/s^2
    covariance: Float[Array, "k k"]  # of the weights of any axis, over the noise density, 1/s
    lagged: Regressor  # regressor as the observer would follow it
    ahead: Regressor  # its modelling error, s
    evidence: Evidence  # whether it helps
    taken: PerAxis  # over from the observer so far, m/s^2, rad/s^2
    inertia: InertiaState | None  # what probing has found


class TrainingSample(NamedTuple):
    """What a memory learns from in one control step, per axis."""

    estimate: PerAxis  # what the observer adds to the memory, m/s^2, rad/s^2
    error: PerAxis  # modelling error of the observer, m/s, rad/s
    tracking_error: PerAxis  # error of the plant from the reference, m, rad
    correction: PerAxis  # desired acceleration besides that of the reference, less `estimate`, m/s^2, rad/s^2
    rate: PerAxis  # velocity of the plant besides that of the reference, m/s, rad/s
    nominal: PerAxis  # F + G u of the applied input besides the acceleration of the reference, m/s^2, rad/s^2


class Memory(eqx.Module):
    """m = W^T phi(reference), learnt by recursive least squares from what the observer still has to add.

    The regressor phi holds 1, the desired acceleration, the direction of gravity, the products of velocities of
    different axes that turning bodies have, and of each velocity v and v |v|, fuzzy rules, or both. Every axis sees all
    of them. Rules are the memberships of normalised Gaussian sets without the middle one, less their values at rest.

    The observer follows d - m with its lag. With all of the memory in use its estimate is (W* - W)^T phi_f, with phi_f
    the regressor behind the same lag, where d = W*^T phi. This is the innovation. With r = T phi_f^T P phi_f,

        W += P phi_f d_rest^T T / (1 + r),    P -= e T P phi_f phi_f^T P / (1 + e r),    e = max(1 - q / r, 0),

    q = T / `horizon`. In directions that are not excited nothing is learnt or forgotten. In those that are, the gain
    does not fall below the one that forgets within the horizon. What the memory gains the observer loses in the same
    step.

    Where the memory harms, less of it is used: m = g W^T phi with the share g of `evidence.trust` for each axis; the
    weights learn on as if all of it were used. Where it is wrong, P returns towards p_0 I at the rate
    `evidence.wrong` / `judging_time`, so that a vehicle that has changed is learnt anew. P never exceeds p_0 I.

    With the inertia h of `InertiaIdentification`, which is not that of the nominal model, the observer adds d_rest to
    h v_dot = F + G u + m - (1 - h) a_r + h d_rest, with the acceleration a_r of the reference. What is known besides
    the observer is then m + (1 - h) c, where a_r + c + d_rest is the acceleration that feedback asks for.

    Raises:
        BadInput: a number that is not positive, or an unknown regressor.
    """

    fuzzy: FuzzySystem
    speeds: Float[Param, " n"] = param("m/s, rad/s", "velocities at the outermost sets")
    horizon: Float[Param, ""] = param("s", "time over which excited directions forget", symbol="tau", default=300.0)
    learning_rate: Float[Param, ""] = param(
        "1/s", "variance of the weights before anything is learnt over the noise density", symbol="p_0", default=10.0
    )
    bound: Float[Param, ""] = param("m/s^2, rad/s^2", "largest weight", symbol="w_max", default=20.0)
    judging_time: Float[Param, ""] = param("s", "time over which the memory is judged", symbol="tau_j", default=30.0)
    inertia: InertiaIdentification | None = None
    start: Float[Array, "k n"] | None = None
    variance: Float[Array, " k"] | None = None
    regressor: str = eqx.field(static=True, default="both")

    def __check_init__(self):
        checks.choice("regressor", self.regressor, REGRESSORS)
        for name in ("speeds", "horizon", "learning_rate", "bound", "judging_time"):
            checks.positive(name, getattr(self, name))

    def check_fit(self, axes: int, body: bool) -> None:
        """Check that this memory fits a plant.

        Raises:
            BadInput: velocities or knowledge for another number of axes or regressors.
        """
        checks.length("speeds", self.speeds, axes, "axes")
        if self.inertia is not None:
            self.inertia.check_fit(axes)
        count = self.size(axes, body)
        shapes = tuple(None if array is None else array.shape for array in (self.start, self.variance))
        if shapes not in ((None, None), ((count, axes), (count,))):
            must = f"have {count} regressors for {axes} axes"
            raise BadInput("knowledge", must, shapes[0], hint="Take the rules and the regressor it was learnt with")

    def init(self, axes: int, body: bool) -> MemoryState:
        """State before the first step: `start` and `variance`, or nothing known."""
        count = self.size(axes, body)
        nothing = jnp.zeros(count)
        weights = jnp.zeros((count, axes)) if self.start is None else jnp.clip(self.start, -self.bound, self.bound)
        variance = jnp.ones(count) if self.variance is None else self.variance
        covariance = jnp.diag(self.learning_rate * variance)
        inertia = None if self.inertia is None else self.inertia.init(axes)
        return MemoryState(weights, covariance, nothing, nothing, evidence.none(axes), jnp.zeros(axes), inertia)

    def size(self, axes: int, body: bool) -> int:
        """Number k of regressors."""
        rules = 0 if self.regressor == "linear" else self.fuzzy.rules - 1
        shapes = 0 if self.regressor == "rules" else 2
        return 1 + axes * (rules + shapes) + axes + (3 + 9 if body else 0)

    def regressors(self, y: Measurement, velocity: PerAxis, tracking_error: TrackingError, body: bool) -> Regressor:
        """phi at the reference.

        Args:
            y: measurement; of it only the attitude is used, turned by the error to that of the reference.
            velocity: of the plant, in the coordinates of the law, m/s and rad/s.
            tracking_error: errors from the reference and its acceleration.
            body: whether the plant is a body, with an attitude and products of velocities.
        """
        share = (velocity + tracking_error.rate) / self.speeds
        parts = [jnp.ones(1), tracking_error.acceleration]
        if self.regressor != "linear":
            still = self.fuzzy.basis(jnp.zeros((1, 1)))
            rules = self.fuzzy.basis(share[:, None]) - still
            middle = self.fuzzy.rules // 2
            parts += [jnp.concatenate([rules[:, :middle], rules[:, middle + 1 :]], -1).reshape(-1)]
        if self.regressor != "rules":
            parts += [share, share * jnp.abs(share)]
        if body:
            down = body_of(y).rotation[2]
            u, turning = share[:3], share[3:]
            around = jnp.stack([u[1], u[2], u[0]])
            further = jnp.stack([u[2], u[0], u[1]])
            parts += [down + cross(down, tracking_error.error[3:]) - jnp.asarray([0.0, 0.0, 1.0])]
            parts += [u * around, turning * around, turning * further]
        return jnp.concatenate(parts)

    def inertia_ratio(self, state: MemoryState) -> PerAxis:
        """h by which corrections are scaled: inertia over that of the nominal model, from 1."""
        if self.inertia is None or state.inertia is None:
            return jnp.ones_like(state.taken)
        return self.inertia.used(state.inertia)

    def inertia_signals(self, state: MemoryState) -> dict[str, PerAxis]:
        """Signals of the identified inertia, if it is identified."""
        if self.inertia is None or state.inertia is None:
            return {}
        return {"inertia": self.inertia.ratio(state.inertia), "inertia_error": self.inertia.error(state.inertia)}

    def probing(self, state: MemoryState, feedback: Float[Array, "*#n 2"]) -> PerAxis:
        """Desired acceleration of the probing oscillation, with the feedback K of its motion, m/s^2 and rad/s^2."""
        if self.inertia is None or state.inertia is None:
            return jnp.zeros_like(state.taken)
        displacement, rate, acceleration = self.inertia.motion(state.inertia)
        return acceleration + feedback[..., 0] * displacement + feedback[..., 1] * rate

    def recalled(self, state: MemoryState, phi: Regressor) -> PerAxis:
        """m, m/s^2 and rad/s^2."""
        return evidence.trust(state.evidence) * matvec(state.weights.T, phi)

    def value(self, state: MemoryState, phi: Regressor, correction: PerAxis) -> PerAxis:
        """What is known besides the observer: m, and what the inertia adds to a correction, m/s^2 and rad/s^2."""
        return self.recalled(state, phi) + (1 - self.inertia_ratio(state)) * correction

    def advance(
        self, state: MemoryState, phi: Regressor, sample: TrainingSample, gains, free, dt
    ) -> tuple[MemoryState, PerAxis]:
        """State one sampling time later, and what the observer loses of its estimate, m/s^2 and rad/s^2.

        Args:
            state: now.
            phi: regressor now.
            sample: of this control step.
            gains: of the observer, per sampling time and 1/s.
            free: 1, or 0 while limits bind and nothing is learnt.
            dt: sampling time, s.
        """
        of_rates, of_estimate = gains
        used, span, h = evidence.trust(state.evidence), free * dt, self.inertia_ratio(state)
        innovation = h * sample.estimate - (1 - used) * matvec(state.weights.T, state.lagged)
        direction = matvec(state.covariance, state.lagged)
        size = dt * (state.lagged * direction).sum()
        forgetting = dt / self.horizon
        share = jnp.where(size > forgetting, 1 - forgetting / jnp.where(size > forgetting, size, 1.0), 0.0)
        weights = state.weights + span / (1 + size) * direction[:, None] * innovation[None, :]
        shrunk = share * span / (1 + share * size) * direction[:, None] * direction[None, :]
        reopened = evidence.wrong(state.evidence) * span / self.judging_time
        unknown = self.learning_rate * jnp.eye(phi.shape[0])
        explained = matvec(state.weights.T, state.ahead)
        alone, inertia = h * sample.error + used * explained, None
        if self.inertia is not None and state.inertia is not None:
            expected = sample.nominal + self.recalled(state, phi)
            inertia = self.inertia.advance(state.inertia, sample.tracking_error, sample.rate, expected, free, dt)
        after = MemoryState(
            weights=jnp.clip(weights, -self.bound, self.bound),
            covariance=state.covariance - shrunk + reopened * (unknown - state.covariance),
            lagged=state.lagged - of_estimate * state.ahead,
            ahead=state.ahead + dt * (state.lagged - phi) - of_rates * state.ahead,
            evidence=evidence.gathered(state.evidence, alone, explained, span, self.judging_time),
            taken=state.taken,
            inertia=inertia,
        )
        gained = self.value(after, phi, sample.correction) - self.value(state, phi, sample.correction)
        lost = gained / self.inertia_ratio(after)
        return after._replace(taken=state.taken + lost), lost


def memory(
    axes: int,
    *,
    regressor: str = "both",
    rules: int = 5,
    speeds=0.5,
    horizon=300.0,
    learning_rate=10.0,
    bound=20.0,
    judging_time=30.0,
    inertia: InertiaIdentification | None = None,
    knowledge: Knowledge | None = None,
) -> Memory:
    """A memory beside an observer.

    Args:
        axes: number of axes.
        regressor: `rules` of each velocity, `linear` for v and v |v|, or `both`.
        rules: sets of each velocity, an odd number from 3.
        speeds: velocity at the outermost sets, m/s and rad/s; one number or one per axis.
        horizon: time over which what is excited forgets, s.
        learning_rate: p_0, 1/s: how fast it learns at first.
        bound: largest weight, m/s^2 and rad/s^2.
        judging_time: time over which the memory is judged by the modelling error, s.
        inertia: identification of the inertia by probing, or None.
        knowledge: what was learnt before.

    Raises:
        BadInput: a number out of its range.
    """
    if not isinstance(rules, int) or rules < 3 or rules % 2 == 0:
        raise BadInput("rules", "be an odd number from 3", rules)
    return Memory(
        fuzzy=gaussian_sets(rules),
        speeds=np.broadcast_to(speeds, (axes,)) if np.ndim(speeds) == 0 else speeds,
        horizon=horizon,
        learning_rate=learning_rate,
        bound=bound,
        judging_time=judging_time,
        inertia=inertia,
        start=None if knowledge is None else knowledge.weights,
        variance=None if knowledge is None else knowledge.variance,
        regressor=regressor,
    )
