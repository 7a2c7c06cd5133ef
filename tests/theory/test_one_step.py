"""What each law demands and what it learns in one step, against its equations written out in NumPy.

All laws are traced into one program, without a plant and without the path from the demand to the inputs, for three
cases: a law that begins, one that runs, and one that runs while the actuators give 60 % of what it demanded.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from two_axes import DT, V, X

from undertow.control import controllers
from undertow.control.controllers.actuation import ActuationResult, actuation_for
from undertow.control.controllers.adaptive_backstepping import BacksteppingState
from undertow.control.controllers.adrc import ExtendedStateObserverState
from undertow.control.controllers.cascade_law import CascadeState
from undertow.control.controllers.disturbance_observer import DisturbanceObserverState as Predicted
from undertow.control.controllers.indi import INDIState
from undertow.control.controllers.integral_sliding_mode import SlidingState
from undertow.control.controllers.l1_adaptive import PredictorState
from undertow.control.controllers.lqi import LQI, LQIState
from undertow.control.controllers.mrac import AdaptiveState
from undertow.control.controllers.neural import NetworkWeights
from undertow.core.contracts import Measurement, Target, TrackingError
from undertow.physics.plants import double_integrator

MODEL = double_integrator(2, limit=4.0).model()
E, R, A = np.array([0.5, -0.3]), np.array([-0.2, 0.6]), np.array([0.1, -0.4])
KNOWN, MISSING = np.array([0.7, -1.1]), np.array([0.25, -0.35])
CASES = {"begins": (0, 1.0), "runs": (1, 1.0), "limited": (1, 0.6)}
SAME = {"sampling_time": DT, "reference_frequency": 0.0}
LAWS = {}


def law_of(make, running):
    """Decorator of the equations of a law: (state, share) to demand, signals and the next state."""

    def keep(equations):
        LAWS[equations.__name__] = make, running, equations
        return equations

    return keep


@law_of(lambda: controllers.pid(MODEL, gains=[[4.0, 1.5, 2.0], [1e4, 1e4, 2.0]], **SAME), np.array([0.3, -0.8]))
def pid(own, share):
    """The second axis takes back within one sampling time: (k_i / k_d)^(1/2) > 1 / T."""
    k_p, k_i, k_d = np.array([4.0, 1e4]), np.array([1.5, 1e4]), np.array([2.0, 2.0])
    back = np.array([np.sqrt(0.75), 1 / DT]) * MISSING
    return A + k_p * E + k_d * R + own, {"estimate": -own}, own + DT * (k_i * E + back)


@law_of(
    lambda: controllers.adrc(
        MODEL, bandwidth=[3.0, 5.0], damping=[0.8, 1.2], feedback=[[2.0, 3.0], [4.0, 1.0]], **SAME
    ),
    ExtendedStateObserverState(np.array([0.6, -0.3]), np.array([1.2, -0.4])),
)
def adrc(own, share):
    w, zeta, eps = np.array([3.0, 5.0]), np.array([0.8, 1.2]), own.rates - V
    demand = A + np.array([2.0, 4.0]) * E + np.array([3.0, 1.0]) * R - own.estimate
    after = own.rates + DT * (KNOWN + own.estimate - 2 * zeta * w * eps), own.estimate - DT * w**2 * eps
    return demand, {"estimate": own.estimate, "modelling_error": eps}, after


@law_of(
    lambda: controllers.indi(
        MODEL, bandwidth=[3.0, 5.0], damping=[0.8, 1.2], feedback=[[2.0, 3.0], [4.0, 1.0]], **SAME
    ),
    INDIState(*np.array([[0.6, -0.3], [0.2, 0.5], [-0.4, 0.9], [1.1, -0.7]])),
)
def indi(own, share):
    w, zeta = np.array([3.0, 5.0]), np.array([0.8, 1.2])
    missing = own.acceleration - own.modelled
    demand = A + np.array([2.0, 4.0]) * E + np.array([3.0, 1.0]) * R - missing
    after = (
        own.velocity + DT * own.acceleration,
        own.acceleration + DT * (w**2 * (V - own.velocity) - 2 * zeta * w * own.acceleration),
        own.modelled + DT * own.modelled_rate,
        own.modelled_rate + DT * (w**2 * (KNOWN - own.modelled) - 2 * zeta * w * own.modelled_rate),
    )
    return demand, {"estimate": missing, "modelling_error": own.velocity - V}, after


@law_of(
    lambda: controllers.disturbance_observer(
        MODEL, bandwidth=[3.0, 5.0], tracking=[2.0, 1.5], damping=[0.8, 1.2], **SAME
    ),
    Predicted(np.array([0.6, -0.3]), np.array([1.2, -0.4]), np.array(0.05)),
)
def disturbance_observer(own, share):
    pole, w, zeta = np.array([3.0, 5.0]), np.array([2.0, 1.5]), np.array([0.8, 1.2])
    estimate = own.estimate
    if own.elapsed > 0:
        estimate = estimate + (1 - np.exp(-pole * own.elapsed)) / own.elapsed * (V - own.predicted)
    demand = A + w**2 * E + 2 * zeta * w * R - estimate
    return demand, {"estimate": estimate}, (V + DT * (KNOWN + estimate), estimate, DT)


@law_of(
    lambda: controllers.l1_adaptive(
        MODEL, predictor=[4.0, 6.0], bandwidth=[3.0, 5.0], tracking=[2.0, 1.5], damping=[0.8, 1.2], **SAME
    ),
    PredictorState(np.array([0.6, -0.3]), np.array([1.2, -0.4]), np.array(0.05)),
)
def l1_adaptive(own, share):
    """sigma = -a_s exp(-a_s T) / (1 - exp(-a_s T)) v_tilde; the predictor is the exact solution over a step."""
    pole, c, w, zeta = np.array([4.0, 6.0]), np.array([3.0, 5.0]), np.array([2.0, 1.5]), np.array([0.8, 1.2])
    step, error = float(own.elapsed) or 1.0, own.predicted - V
    sigma = -pole * np.exp(-pole * step) / (1 - np.exp(-pole * step)) * error
    filtered = own.filtered + (1 - np.exp(-c * own.elapsed)) * (sigma - own.filtered)
    moved = np.exp(-pole * DT) * error + (1 - np.exp(-pole * DT)) / pole * sigma
    demand = A + w**2 * E + 2 * zeta * w * R - filtered
    return demand, {"estimate": filtered, "modelling_error": error}, (V + DT * KNOWN + moved, filtered, DT)


@law_of(
    lambda: LQI(
        MODEL,
        actuation_for(DT, 2.0),
        frequency=2.0,
        integral_weight=0.1,
        rate_weight=1.0,
        lag=0.1,
        sampling_time=DT,
        gains=[[1.5, 4.0, 3.0, 0.2], [7500.0, 2.0, 2.0, 0.4]],
    ),
    LQIState(np.array([0.3, -0.8]), np.array([0.6, 0.2])),
)
def lqi(own, share):
    """The second axis takes back within one sampling time: (K_q / K_v)^(1/2) > 1 / T."""
    q, e, v, a = np.array([[1.5, 4.0, 3.0, 0.2], [7500.0, 2.0, 2.0, 0.4]]).T
    demand = A + e * E + v * R + own.integral - a * (own.acceleration - A)
    back = np.array([np.sqrt(0.5), 1 / DT]) * MISSING
    reached = 1 - np.exp(-DT / 0.1)
    after = own.integral + DT * (q * E + back), own.acceleration + reached * (demand + MISSING - own.acceleration)
    return demand, {"estimate": -own.integral / (1 + a)}, after


@law_of(
    lambda: controllers.mrac(
        MODEL,
        frequency=[2.0, 1.5],
        damping=[0.8, 1.2],
        adaptation=[3.0, 1e3],
        e_modification=[0.3, 0.1],
        bound=[1.5, 30.0],
        scale=[5.0, 7.0],
        filter_ratio=[0.5, 0.4],
        **SAME,
    ),
    AdaptiveState(np.array([[1.49, -0.3, 0.2, 0.6], [-0.7, 0.4, 0.1, -1.1]]), E / 2 + 0.1, R / 3 - 0.2, np.array(1.0)),
)
def mrac(own, share):
    """One parameter of the first axis is stopped by its bound; the second axis learns at the largest stable speed."""
    w, zeta, sigma = np.array([2.0, 1.5]), np.array([0.8, 1.2]), np.array([0.3, 0.1])
    nominal = A + w**2 * E + 2 * zeta * w * R
    phi = np.stack([np.ones(2), V, np.abs(V) * V, nominal / [5.0, 7.0]], -1)
    behind = E - own.error if own.begun else np.zeros(2)
    error, rate = (own.error, own.rate) if own.begun else (E, R)
    s = R - rate + np.array([0.5, 0.4]) * w * (E - error)
    speed = np.minimum([3.0, 1e3], zeta * w / (DT * (phi**2).sum(-1)))
    assert speed[0] == 3.0
    assert speed[1] < 1e3
    moved = phi * s[:, None] + (sigma * np.abs(s))[:, None] * own.parameters
    box = np.array([[1.5], [30.0]])
    pull = -(w**2) * error - 2 * zeta * w * rate - MISSING
    adapted = (own.parameters * phi).sum(-1)
    after = (
        np.clip(own.parameters - DT * speed[:, None] * moved, -box, box),
        error + DT * rate + DT**2 / 2 * pull,
        rate + DT * pull,
        1.0,
    )
    return nominal - adapted, {"estimate": adapted, "model_error": behind}, after


def backstepping(lag, own, share):
    """From the three steps; alpha_dot without the load's error, differentiated term by term."""
    c, inner, gamma = np.array([2.0, 1.5]), np.array([5.0, 7.0]), np.array([0.6, 0.9])
    z2 = R + c * E
    alpha = A + c * R + c**2 * E + c * z2 - own.load
    demand, learning = alpha, -gamma * z2
    if lag:
        x = own.acceleration
        z3 = alpha - x
        learning = -gamma * (z2 + 2 * z3 / c)
        bend = A - x - own.load  # of e, but for the error of the estimate
        alpha_dot = c * bend + c**2 * R + c * (bend + c * R) - learning
        demand = x + lag * (inner * z3 + c**2 * z2 + alpha_dot)
    going = 1 - np.exp(-DT / lag) if lag else 1.0
    learnt = np.clip(own.load + DT * learning * (share == 1.0), [-1.0, -0.405], [1.0, 0.405])
    return demand, {"estimate": own.load}, (learnt, own.acceleration + going * (demand + MISSING - own.acceleration))


BACKSTEPPING = {"rate": [2.0, 1.5], "inner_rate": [5.0, 7.0], "adaptation": [0.6, 0.9], "bound": [1.0, 0.405]}
STEPPED = BacksteppingState(np.array([0.7, -0.4]), np.array([0.6, 0.2]))


@law_of(lambda: controllers.adaptive_backstepping(MODEL, lag=0.16, **BACKSTEPPING, **SAME), STEPPED)
def adaptive_backstepping(own, share):
    return backstepping(0.16, own, share)


@law_of(lambda: controllers.adaptive_backstepping(MODEL, lag=0.159, **BACKSTEPPING, **SAME), STEPPED)
def adaptive_backstepping_without_lag(own, share):
    """A lag below eight sampling times is none."""
    return backstepping(0.0, own, share)


@law_of(
    lambda: controllers.integral_sliding_mode(
        MODEL, frequency=[2.0, 1.5], damping=[0.8, 1.2], amplitude=[3.0, 2.0], layer=[0.5, 0.4], **SAME
    ),
    SlidingState(np.array([0.3, 0.5]), np.array(1.0)),
)
def integral_sliding_mode(own, share):
    """The second axis is outside its layer."""
    w, zeta = np.array([2.0, 1.5]), np.array([0.8, 1.2])
    nominal = w**2 * E + 2 * zeta * w * R
    surface = R + own.integral if own.begun else np.zeros(2)
    switching = np.array([3.0, 2.0]) * np.clip(surface / [0.5, 0.4], -1, 1)
    start = own.integral if own.begun else -R
    return (
        A + nominal + switching,
        {"estimate": -switching, "surface": surface},
        (start + DT * (nominal + MISSING), 1.0),
    )


@law_of(
    lambda: controllers.super_twisting(
        MODEL, slope=[2.0, 1.5], rate_bound=[3.0, 2.0], layer=[0.5, 1e-9], first=[1.5, 1.8], second=[1.2, 1.4], **SAME
    ),
    np.array([0.3, -0.8]),
)
def super_twisting(own, share):
    """The first axis beyond its layer, the second, too, where windup is undone within one sampling time."""
    slope, bound, first, second = np.array([[2.0, 1.5], [3.0, 2.0], [1.5, 1.8], [1.2, 1.4]])
    s = R + slope * E
    demand = A + slope * R + first * np.sqrt(bound) * np.sqrt(np.abs(s)) * np.sign(s) + own
    steep = slope[0] + first[0] * np.sqrt(bound[0] / 0.5)
    back = np.array([np.sqrt(slope[0] * second[0] * bound[0] / 0.5 / steep), 1 / DT]) * MISSING
    return demand, {"estimate": -own, "surface": s}, own + DT * (second * bound * np.sign(s) + back)


@law_of(
    lambda: controllers.super_twisting(
        MODEL, slope=[2.0, 1.5], rate_bound=[3.0, 2.0], layer=[1.6, 0.4], first=[1.5, 1.8], second=[1.2, 1.4], **SAME
    ),
    np.array([0.3, -0.8]),
)
def super_twisting_in_its_layer(own, share):
    slope, bound, first, second = np.array([[2.0, 1.5], [3.0, 2.0], [1.5, 1.8], [1.2, 1.4]])
    layer, s = np.array([1.6, 0.4]), R + slope * E
    demand = A + slope * R + first * np.sqrt(bound / layer) * s + own
    k_i, k_d = slope * second * bound / layer, slope + first * np.sqrt(bound / layer)
    after = own + DT * (second * bound / layer * s + np.sqrt(k_i / k_d) * MISSING)
    return demand, {"estimate": -own, "surface": s}, after


@law_of(
    lambda: controllers.slotine_li(
        MODEL,
        slope=[2.0, 1.5],
        gain=[3.0, 4.0],
        adaptation_rate=[0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
        reach=[0.4, 2.0],
        **SAME,
    ),
    np.array([1.2, 0.7, 1.1, 0.9, 0.4, -99.9999]),
)
def slotine_li(own, share):
    """Factors of inertia and drift, and loads; drift is zero here. The first error is beyond the reach."""
    slope, gain = np.array([2.0, 1.5]), np.array([3.0, 4.0])
    s = R + slope * np.clip(E, [-0.4, -2.0], [0.4, 2.0])
    wanted = A + slope * R * [0.0, 1.0]
    force, nominal = own[:2] * wanted + own[4:], wanted
    rates = np.array([0.01, 0.01, 0.01, 0.01, 1.0, 1.0]) * [0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
    by_parameter = np.concatenate([wanted * s, np.zeros(2), s])
    rate = rates * by_parameter
    added, taken = DT * (by_parameter * rate).sum(), (gain * s**2).sum()
    assert added < taken
    most, middle = np.array([0.8, 0.8, 0.8, 0.8, 100.0, 100.0]), np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    signals = {"estimate": nominal - force, "surface": s, "parameter_change": (np.abs(own - middle) / most).max()}
    return force + gain * s, signals, np.clip(own + DT * rate * (share == 1.0), middle - most, middle + most)


@law_of(
    lambda: controllers.neural(
        MODEL,
        hidden=3,
        seed=4,
        slope=[2.0, 1.5],
        gain=[3.0, 4.0],
        adaptation=0.6,
        hidden_adaptation=0.7,
        e_modification=0.2,
        robust_gain=0.05,
        weights_bound=8.0,
        **SAME,
    ),
    NetworkWeights(np.random.default_rng(5).normal(size=(4, 2)), np.random.default_rng(6).normal(size=(9, 3))),
)
def neural(own, share):
    """Lewis, Yesildirek and Liu (1996), with the network's derivatives by its own sigmoids."""
    slope, gain, f = np.array([2.0, 1.5]), np.array([3.0, 4.0]), 0.6
    r, x = R + slope * E, np.concatenate([[1.0], E, R, V, A])
    sigma = 1 / (1 + np.exp(-own.hidden.T @ x))
    prime = np.diag(sigma * (1 - sigma))
    size, off = np.sqrt((own.output**2).sum() + (own.hidden**2).sum()), np.linalg.norm(r)
    learnt = own.output.T @ np.concatenate([[1.0], sigma])
    robust = 0.05 * (size + 8.0) * r
    by_output = np.outer(np.concatenate([[1.0], sigma - prime @ own.hidden.T @ x]), f * r) - 0.2 * off * f * own.output
    by_hidden = 0.7 * (np.outer(x, prime @ own.output[1:] @ r) - 0.2 * off * own.hidden)
    step = DT * (share == 1.0)
    signals = {"estimate": -learnt, "robust_term": robust, "weights_size": size}
    return (
        A + slope * R + gain * r + learnt + robust,
        signals,
        (own.output + step * by_output, own.hidden + step * by_hidden),
    )


def nested(own, share, limits):
    p, k, k_i, k_d, filtering = np.array([[2.0, 1.5], [3.0, 4.0], [1.2, 1e4], [0.3, 0.2], [20.0, 30.0]])
    rate, integral, limit = limits
    error = R + np.clip(p * E, -rate, rate)
    slope, smooth = np.zeros(2), error
    if own.elapsed > 0:
        new = 1 - np.exp(-filtering * own.elapsed)
        slope, smooth = new * (error - own.smooth) / own.elapsed, own.smooth + new * (error - own.smooth)
    demand = np.clip(A + k * error + own.integral + k_d * slope, -limit, limit)
    back = np.array([np.sqrt(1.2 * 2.0 / 3.0), 1 / DT]) * MISSING
    after = np.clip(own.integral + DT * (k_i * error + back), -integral, integral)
    return demand, {"estimate": -own.integral}, (after, smooth, DT)


NESTED = CascadeState(np.array([0.4, -0.3]), np.array([0.2, 0.5]), np.array(0.03))
NESTED_GAINS = {
    "outer": [2.0, 1.5],
    "inner": [3.0, 4.0],
    "integral": [1.2, 1e4],
    "derivative": [0.3, 0.2],
    "derivative_filter": [20.0, 30.0],
}


@law_of(lambda: controllers.cascade(MODEL, **NESTED_GAINS, **SAME), NESTED)
def cascade(own, share):
    """The second axis takes back within one sampling time: (k_i p / k)^(1/2) > 1 / T."""
    return nested(own, share, (np.inf, np.inf, np.inf))


def limited_cascade():
    made = controllers.cascade(MODEL, **NESTED_GAINS, rate_limit=[0.7, 0.3], **SAME)
    limits = lambda law: (law.integral_limit, law.limit)
    return eqx.tree_at(limits, made, (jnp.array([0.41, 0.2]), jnp.array([1.3, 6.0])))


@law_of(limited_cascade, NESTED)
def cascade_within_limits(own, share):
    return nested(own, share, (np.array([0.7, 0.3]), np.array([0.41, 0.2]), np.array([1.3, 6.0])))


@pytest.fixture(scope="module")
def steps():
    """Start, and what every law does in every case: one compiled program."""
    y, off = Measurement(X, V), TrackingError(E, R, A)
    still = Target(X, V, A)
    made = {name: make() for name, (make, _, _) in LAWS.items()}
    starts = {name: law.init_law(y, still) for name, law in made.items()}
    running = {name: one for name, (_, one, _) in LAWS.items()}
    which, shares = (np.array(column) for column in zip(*CASES.values(), strict=True))
    states = jax.tree.map(lambda *both: np.stack(both)[which], starts, running)

    @jax.jit
    @jax.vmap
    def taken(own, share):
        given = ActuationResult(jnp.asarray(KNOWN), jnp.asarray(MISSING), share)
        return {
            name: (*law.acceleration(own[name], y, off), law.update(own[name], y, off, given, jnp.asarray(DT)))
            for name, law in made.items()
        }

    return made, states, taken(states, shares)


def at_place(tree, place):
    return jax.tree.map(lambda leaf: np.asarray(leaf)[place], tree)


@pytest.mark.parametrize("name", LAWS)
def test_one_step_is_that_of_the_equations(steps, name):
    made, states, found = steps
    assert set(found[name][1]) | {"attained_share"} == set(made[name].signals())
    for place, (_, share) in enumerate(CASES.values()):
        demand, signals, after = at_place(found[name], place)
        expected, their_signals, their_after = LAWS[name][2](at_place(states[name], place), share)
        np.testing.assert_allclose(demand, expected, rtol=1e-11)
        for signal, value in their_signals.items():
            np.testing.assert_allclose(signals[signal], value, rtol=1e-11, atol=1e-13, err_msg=signal)
        for leaf, value in zip(jax.tree.leaves(after), jax.tree.leaves(their_after), strict=True):
            np.testing.assert_allclose(leaf, value, rtol=1e-11, atol=1e-13)
