"""Numbers that laws choose where none are given, as their descriptions say; and the small-signal law of each rule."""

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

from undertow.control import controllers
from undertow.control.controllers.adaptive_backstepping import backstepping_rate
from undertow.control.controllers.bandwidths import (
    Axis,
    LoopTransfer,
    axes_of,
    bandwidth_grid,
    best_frequency,
    robust_bandwidths,
)
from undertow.control.controllers.integral_sliding_mode import _inside_the_layer as sliding_law
from undertow.control.controllers.lqi import lqi_frequency
from undertow.control.controllers.mrac import _load_alone
from undertow.control.controllers.options import DesignConditions
from undertow.control.controllers.slotine_li import _small_errors
from undertow.control.controllers.super_twisting import _inside_the_layer as twisting_law
from undertow.core.errors import BadInput
from undertow.core.param import tuning_ranges
from undertow.physics.plants import double_integrator

DT = 0.02
W = np.array([2.0, 6.0])
LIMITED, UNLIMITED = double_integrator(2, limit=4.0).model(), double_integrator(2).model()
AXIS = axes_of(LIMITED, DesignConditions(DT, load_rate=1.0))[0]
LAGGED = Axis(DT, 0.3, 0.35 / DT, 0.0, 0.0, 1.0, 4.0)

# Law: main option, defaults of the others, and the natural frequency on which the filter of jumps depends.
DEFAULTS = {
    "pid": ("frequency", {"proportional": W**2, "integral": W**3 / 10, "derivative": 2 * W}, W),
    "mrac": (
        "frequency",
        {
            "damping": 1.0,
            "adaptation": W**2 / 5,
            "e_modification": 0.0,
            "bound": 4.0,
            "scale": 8.0,
            "filter_ratio": 0.5,
        },
        W,
    ),
    "adaptive_backstepping": (
        "rate",
        {"inner_rate": 4 * W, "adaptation": 0.3 * W**2, "bound": 4.0, "lag": 0.0, "lagged": False},
        W,
    ),
    "integral_sliding_mode": ("frequency", {"damping": 1.0, "amplitude": 2.0, "layer": 2.0 / (0.3 * W)}, W),
    "super_twisting": (
        "slope",
        {"rate_bound": 0.4, "first": 2.0, "second": 1.1, "layer": 0.4 * (2.0 / (2 * W)) ** 2},
        2 * W,
    ),
    "slotine_li": ("slope", {"gain": W, "adaptation_rate": 0.4, "reach": 2.0 / W**2}, W),
    "adrc": ("bandwidth", {"damping": 1.0}, None),
    "indi": ("bandwidth", {"damping": 1.0}, None),
    "disturbance_observer": ("bandwidth", {"damping": 1.0}, None),
    "l1_adaptive": ("bandwidth", {"damping": 1.0, "predictor": 1.0}, None),
    "nmpc": ("bandwidth", {"steps": 10, "iterations": 2}, None),
}
WITHOUT_LIMIT = {
    "mrac": {"bound": 10.0, "scale": 20.0},
    "adaptive_backstepping": {"bound": 10.0},
    "integral_sliding_mode": {"amplitude": 10.0},
    "super_twisting": {"rate_bound": 1.0},
    "slotine_li": {"reach": 1e6},
}


def made(name, model=LIMITED, **options):
    return getattr(controllers, name)(model, sampling_time=DT, **options)


@pytest.mark.parametrize("name", DEFAULTS)
def test_other_numbers_follow_from_the_main_one(name):
    option, expected, natural = DEFAULTS[name]
    law = made(name, **{option: W})
    for key, value in expected.items():
        np.testing.assert_allclose(getattr(law, key), value, rtol=1e-12, err_msg=key)
    assert float(law.actuation.direction) == 1.0
    if natural is not None:
        np.testing.assert_allclose(law.actuation.filter.frequency, np.minimum(natural / 2, 2.0))
        np.testing.assert_allclose(law.actuation.actuator_rate, 0.15 / DT)
        assert law.actuation.motor == "steady"
    for key, value in WITHOUT_LIMIT.get(name, {}).items():
        np.testing.assert_allclose(getattr(made(name, UNLIMITED, **{option: W}), key), value, err_msg=key)
    assert law.actuation.feedforward
    assert made(name, **{option: W}, reference_frequency=0.0).actuation.filter is None


@pytest.mark.parametrize("name", ["adrc", "indi", "disturbance_observer", "l1_adaptive", "nmpc"])
def test_laws_with_an_observer_share_their_rule(name):
    """With a bandwidth tracking is from a quarter to half of it and the actuators are three times as fast; or all by the rule."""
    order = 2 if name in ("adrc", "indi") else 1
    chosen = robust_bandwidths(AXIS, order)
    given = np.array([chosen.tracking, 8 * chosen.tracking])
    own, free = made(name, bandwidth=given), made(name)
    tracking = np.array([0.5, 2.0]) * chosen.tracking
    for law, bandwidth, w in ((own, given, tracking), (free, chosen.bandwidth, chosen.tracking)):
        np.testing.assert_allclose(law.bandwidth, bandwidth)
        if order == 2:
            np.testing.assert_allclose(law.feedback, np.stack([w**2, 2 * w], -1))
        else:
            np.testing.assert_allclose(law.tracking, w)
        np.testing.assert_allclose(law.actuation.filter.frequency, np.minimum(w / 2, 2.0))
        assert law.actuation.motor == "computed"
    rate = min(3 * given.max(), 0.35 / DT)
    np.testing.assert_allclose(own.actuation.actuator_rate, rate)
    np.testing.assert_allclose(free.actuation.actuator_rate, chosen.actuators)
    if order == 2:
        fed = made(name, bandwidth=given, feedback=[2.0, 3.0])
        assert fed.actuation.filter is None
        np.testing.assert_allclose(fed.feedback, [2.0, 3.0])
        with pytest.raises(BadInput, match=r"^`tracking"):
            made(name, feedback=[2.0, 3.0], tracking=1.0)
    if name == "nmpc":
        np.testing.assert_allclose(made(name, bandwidth=4.0, tracking=[8.0, 9.0]).horizon, 0.5)
        np.testing.assert_allclose(made(name, bandwidth=4.0, tracking=[2.0, 9.0]).horizon, 1.0)


S = 1j * np.array([0.3, 2.0, 11.0])


def as_pid(k_p, k_i, k_d):
    return LoopTransfer(k_p + k_i / S, k_d + 0 * S)


def documented(name, law):
    """Gains (k_p, k_i, k_d) of a law for small errors, as its class says, from the numbers that it has."""
    number = lambda key: float(np.ravel(getattr(law, key))[0])
    if name == "mrac":
        w, gamma = number("frequency"), number("adaptation")
        return w**2 + gamma, gamma * number("filter_ratio") * w, 2 * w
    if name == "slotine_li":
        slope, gain, gamma = number("slope"), number("gain"), number("adaptation_rate")
        return gain * slope + gamma, gamma * slope, slope + gain
    if name == "integral_sliding_mode":
        w, c = number("frequency"), number("amplitude") / number("layer")
        return w**2 + 2 * w * c, c * w**2, 2 * w + c
    slope, layer, bound = number("slope"), number("layer"), number("rate_bound")
    steep, second = number("first") * np.sqrt(bound / layer), number("second") * bound / layer
    return slope * steep + second, slope * second, slope + steep


RULES = {
    "mrac": ("frequency", _load_alone),
    "slotine_li": ("slope", _small_errors),
    "integral_sliding_mode": ("frequency", sliding_law),
    "super_twisting": ("slope", twisting_law),
}


@pytest.mark.parametrize("name", RULES)
def test_rule_chooses_by_the_law_that_small_errors_see(name):
    option, rule = RULES[name]
    law = made(name)
    value = float(np.ravel(getattr(law, option))[0])
    for found, expected in zip(rule(value, S), as_pid(*documented(name, law)), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert value == best_frequency(AXIS, rule)
    assert bandwidth_grid(AXIS)[0] < value < bandwidth_grid(AXIS)[-1]


def test_backstepping_is_chosen_by_its_own_linear_law():
    """Without lag a PID; with it the three steps, whose estimate and actuators are solved for at each frequency."""
    pid_like = lambda c, s: LoopTransfer(2 * c**2 + 0.3 * c**2 + 0.3 * c**3 / s, 2 * c + 0 * s)
    assert backstepping_rate(AXIS, None) == best_frequency(AXIS, pid_like)
    assert float(np.ravel(made("adaptive_backstepping").rate)[0]) == backstepping_rate(AXIS, None)

    rule = lambda c, s: LoopTransfer(three_steps(c, s, 1.0, 0.0), three_steps(c, s, 0.0, 1.0))
    assert backstepping_rate(LAGGED, LAGGED.lag) == best_frequency(LAGGED, rule)


def three_steps(c, s, e, v):
    """Demand of backstepping per error e and rate v: a = x + lag (4 c z3 + c^2 z2 + alpha_dot), x behind the lag."""
    gamma, kept = 0.3 * c**2, np.exp(-DT / LAGGED.lag)
    z2 = v + c * e
    alpha = c * v + c**2 * e + c * z2  # without the load
    # s load = -gamma (z2 + 2 / c (alpha - load - x)): the load is affine in x.
    load = lambda x: -gamma * (z2 + 2 / c * (alpha - x)) / (s - 2 * gamma / c)

    def demand(x):
        alpha_dot = 2 * c * (-x - load(x)) + 2 * c**2 * v - s * load(x)
        return x + LAGGED.lag * (4 * c * (alpha - load(x) - x) + c**2 * z2 + alpha_dot)

    alone, by_x = demand(0.0), demand(1.0) - demand(0.0)
    return alone / (1 - by_x * (1 - kept) / (np.exp(s * DT) - kept))


def regulator_of_scipy(w):
    """Gains of LQI with the usual weights: integral by Euler's method, the rest sampled exactly."""
    a, b = np.eye(4), np.zeros((4, 1))
    flow = np.zeros((4, 4))
    flow[0, 1], flow[1, 2], flow[2, 2:] = 1.0, -1.0, [-1 / LAGGED.lag, 1 / LAGGED.lag]
    step = expm(flow * DT)
    a[0, 1], a[1:, 1:], b[1:, 0] = DT, step[:3, :3], step[:3, 3]
    weight = np.diag([0.1 * w**3, w**2, w, 0.0]) ** 2
    p = solve_discrete_are(a, b, weight, np.eye(1))
    return np.linalg.solve(np.eye(1) + b.T @ p @ b, b.T @ p @ a)[0] * [-1, -1, -1, 1]


def test_lqi_is_chosen_by_its_own_linear_law():
    def loop(w, s):
        q, e, v, a = np.array([regulator_of_scipy(one) for one in w[:, 0]]).T[:, :, None]
        behind = (1 - np.exp(-DT / 0.3)) / (np.exp(s * DT) - np.exp(-DT / 0.3))
        inner = 1 + a * behind
        return LoopTransfer((e + q / s) / inner, v / inner)

    assert lqi_frequency(LAGGED, 0.1, 1.0, 0.3) == best_frequency(LAGGED, loop)


def test_neural_gains_and_inputs():
    """F (hidden / 4 + 1) is a quarter of the stiffness; five inputs per two axes and 1, weights within 0.5 / 3."""
    law = made("neural", slope=W, gain=[3.0, 4.0], hidden=6)
    np.testing.assert_allclose(law.adaptation, W * [3.0, 4.0] / 4 / (6 / 4 + 1))
    np.testing.assert_allclose(law.actuation.filter.frequency, np.minimum(np.sqrt(W * [3.0, 4.0]) / 2, 2.0))
    for key, value in {"hidden_adaptation": 1, "e_modification": 0.1, "robust_gain": 0.02, "weights_bound": 10}.items():
        assert float(getattr(law, key)) == value
    assert law.start.shape == (9, 6)
    assert 0.9 < 6 * np.abs(law.start).max() <= 1.0
    free = made("neural")
    pid = made("pid")
    np.testing.assert_allclose(free.slope, np.sqrt(pid.proportional))
    np.testing.assert_allclose(free.gain, np.sqrt(pid.proportional))
    assert free.start.shape == (9, 8)


@pytest.mark.parametrize("name", [*DEFAULTS, "neural", "cascade", "lqi"])
def test_what_is_chosen_lies_in_the_range_of_tuning(name):
    law = made(name)
    for option, (low, high) in tuning_ranges(law).items():
        assert 0 < low < high, option
        value = np.asarray(getattr(law, option))
        assert ((low <= value) & (value <= high)).all(), option
