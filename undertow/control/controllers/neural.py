"""A neural network that learns the uncertainty while it controls, with guaranteed bounds: Lewis et al. (1996)."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.actuation import AbstractAccelerationLaw, Actuation, ActuationResult, actuation_for
from undertow.control.controllers.bandwidths import axes_of, pid_frequency, scalar_if_uniform
from undertow.control.controllers.law_signals import ATTAINED_SHARE, ESTIMATE, ROBUST_TERM
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.contracts import Measurement, Model, Target, TrackingError
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec, safe_sqrt
from undertow.core.option_groups import flat_options
from undertow.core.param import Param, param
from undertow.core.signals import Signal

PerAxis = Float[Array, " n"]

_WHOLE = 0.999  # an attained share below this means that limits bind
_SIZE = {"weights_size": Signal((), "1", "Frobenius norm of all weights of the network")}


class NetworkWeights(NamedTuple):
    """State of the law: the weights of the network."""

    output: Float[Array, "hidden+1 n"]  # W, m/s^2, rad/s^2; the first row is a bias
    hidden: Float[Array, "inputs hidden"]  # V; the first row is a bias


class NetworkEvaluation(NamedTuple):
    """The network at one instant."""

    filtered: PerAxis  # r = e_dot + Lambda e, m/s, rad/s
    inputs: Float[Array, " inputs"]  # x
    layer: Float[Array, " hidden"]  # sigma(V^T x), without the bias
    size: Float[Array, ""]  # |Z|_F


class Neural(AbstractAccelerationLaw):
    """a = a_d + Lambda e_dot + K_v r + W^T sigma(V^T x) + K_z (|Z|_F + Z_M) r with r = e_dot + Lambda e.

    W_dot = F sigma r^T - F sigma' V^T x r^T - kappa F |r| W, V_dot = G x (sigma'^T W r)^T - kappa G |r| V, by Euler's
    method. Inputs x: 1, e, e_dot, the velocity, the acceleration of the target, and the sines of positions that are
    angles. Nothing is learnt while limits bind, nor from errors that no input moves. The tracking error and the weights
    are ultimately bounded.

    Raises:
        BadInput: a gain of the wrong sign.
    """

    model: Model
    actuation: Actuation
    start: Float[Array, "inputs hidden"]  # V at the start
    slope: Float[Param, "..."] = param("1/s", "pole of the filtered error", symbol="Lambda", range=(0.1, 30.0))
    gain: Float[Param, "..."] = param("1/s", "gain of the filtered error", symbol="K_v", range=(0.1, 30.0))
    adaptation: Float[Param, "..."] = param(
        "1/s^2", "adaptation gain of the output layer", symbol="F", range=(1e-3, 30.0)
    )
    hidden_adaptation: Float[Param, ""] = param("", "adaptation gain of the hidden layer", symbol="G")
    e_modification: Float[Param, ""] = param("", "decay of the weights with the error", symbol="kappa")
    robust_gain: Float[Param, ""] = param("1/s", "gain of the robust term per size of the weights", symbol="K_z")
    weights_bound: Float[Param, ""] = param("", "bound of the size of the ideal weights", symbol="Z_M")

    def __check_init__(self):
        for name in ("slope", "gain"):
            checks.positive(name, getattr(self, name), "1/s")
        for name in ("adaptation", "hidden_adaptation", "e_modification", "robust_gain", "weights_bound"):
            checks.not_negative(name, getattr(self, name))
        for name in ("slope", "gain", "adaptation"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))

    def init_law(self, y: Measurement, r: Target) -> NetworkWeights:
        return NetworkWeights(jnp.zeros((self.start.shape[1] + 1, y.position.shape[0])), self.start)

    def acceleration(self, state: NetworkWeights, y: Measurement, tracking_error: TrackingError):
        network = self._evaluate(state, y, tracking_error)
        learned = state.output[0] + matvec(state.output[1:].T, network.layer)
        robust = self.robust_gain * (network.size + self.weights_bound) * network.filtered
        feedback = tracking_error.acceleration + self.slope * tracking_error.rate + self.gain * network.filtered
        demanded = feedback + learned + robust
        return demanded, {"estimate": -learned, "robust_term": robust, "weights_size": network.size}

    def update(
        self, state: NetworkWeights, y: Measurement, tracking_error: TrackingError, actuation: ActuationResult, dt
    ) -> NetworkWeights:
        network = self._evaluate(state, y, tracking_error)
        inner = network.layer * (1 - network.layer)  # sigma' of a sigmoid
        reachable = self._within_reach(y, network.filtered)  # an error that no input moves would be learnt for ever
        size = safe_sqrt((reachable**2).sum())
        regressor = jnp.concatenate([jnp.ones(1), network.layer - inner * matvec(state.hidden.T, network.inputs)])
        by_output = (self.adaptation * reachable)[None, :] * regressor[:, None] - (
            self.e_modification * size * self.adaptation * state.output
        )
        backpropagated = inner * matvec(state.output[1:], reachable)
        by_hidden = self.hidden_adaptation * (
            network.inputs[:, None] * backpropagated[None, :] - self.e_modification * size * state.hidden
        )
        step = jnp.where(actuation.share < _WHOLE, 0.0, dt)
        return NetworkWeights(state.output + step * by_output, state.hidden + step * by_hidden)

    def signals(self):
        return ESTIMATE | ROBUST_TERM | _SIZE | ATTAINED_SHARE

    def _evaluate(self, state: NetworkWeights, y: Measurement, tracking_error: TrackingError) -> NetworkEvaluation:
        inputs = _inputs(self.model, y, tracking_error)
        layer = jax.nn.sigmoid(matvec(state.hidden.T, inputs))
        size = safe_sqrt((state.output**2).sum() + (state.hidden**2).sum())
        return NetworkEvaluation(tracking_error.rate + self.slope * tracking_error.error, inputs, layer, size)


@flat_options()
def neural(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    hidden: int = 8,
    seed: int = 0,
    slope=None,
    gain=None,
    adaptation=None,
    hidden_adaptation=1.0,
    e_modification=0.1,
    robust_gain=0.02,
    weights_bound=10.0,
    actuation: ActuationOptions = ActuationOptions(),
) -> Neural:
    """Neural-network control with e-modification: Lewis, Yesildirek and Liu (1996). Body axes.

    The network learns the part of the acceleration that the model lacks, without training beforehand; at the start it
    gives zero. The weights are tuned by the source's modified backpropagation, for which it proves bounds of error and
    weights. Unlike there, the mass matrix is that of the model and not learnt, and the target's position and velocity
    are inputs only through the errors.

    Args:
        model: nominal model, from `plant.model()`.
        hidden: neurons of the hidden layer.
        seed: of the hidden weights at the start, uniform within 0.5 over the root of the number of inputs.
        slope: Lambda, pole of the filtered error, 1/s; one number or one per axis. None: the frequency of `pid`.
        gain: K_v, gain of the filtered error, 1/s; None: the frequency of `pid`.
        adaptation: F, adaptation gain of the output layer, 1/s^2; None: a quarter of K_v Lambda over hidden / 4 + 1,
            so that the bias and the neurons together act on a constant load as an integral gain of that quarter.
        hidden_adaptation: G, adaptation gain of the hidden layer.
        e_modification: kappa, decay of the weights with the size of the filtered error.
        robust_gain: K_z, gain of the robust term per size of the weights, 1/s.
        weights_bound: Z_M, bound of the size of the ideal weights.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of sqrt(K_v Lambda), 2 at most;
            0 for no filter.

    Raises:
        BadInput: a value is out of its range.
    """
    if hidden < 1:
        raise BadInput("hidden", "be at least 1", hidden)
    model = model.in_body_axes()
    if slope is None or gain is None:
        axes = axes_of(model, conditions)
        w = scalar_if_uniform([pid_frequency(axis) for axis in axes])
        slope, gain = w if slope is None else slope, w if gain is None else gain
    for name, value in (("slope", slope), ("gain", gain)):
        checks.positive(name, value, "1/s")
    stiffness = jnp.asarray(slope, dtype=float) * jnp.asarray(gain, dtype=float)
    still = jnp.zeros(len(model.coordinates.angles))
    resting = model.coordinates.measurement(still, still)
    count = eqx.filter_eval_shape(_inputs, model, resting, TrackingError(still, still, still)).shape[0]
    spread = 0.5 / np.sqrt(count)
    return Neural(
        model=model,
        actuation=actuation_for(conditions.sampling_time, jnp.sqrt(stiffness), actuation),
        start=jnp.asarray(np.random.default_rng(seed).uniform(-spread, spread, (count, hidden))),
        slope=slope,
        gain=gain,
        adaptation=stiffness / (hidden + 4) if adaptation is None else adaptation,
        hidden_adaptation=hidden_adaptation,
        e_modification=e_modification,
        robust_gain=robust_gain,
        weights_bound=weights_bound,
    )


def _inputs(model: Model, y: Measurement, tracking_error: TrackingError) -> Float[Array, " inputs"]:
    """Inputs x of the network."""
    turning = np.flatnonzero(np.array(model.coordinates.angles))
    sines = jnp.sin(y.position[turning])
    error, rate, acceleration = tracking_error
    return jnp.concatenate([jnp.ones(1), error, rate, model.coordinates.velocity(y), acceleration, sines])
