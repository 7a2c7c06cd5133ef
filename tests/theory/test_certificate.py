"""The certificate of a run: V falls where every hypothesis holds (I15, I16, X4), and rises where one of them fails."""

import json

import numpy as np
import pytest

import undertow as ut
from undertow.analysis import theory
from undertow.analysis.certificate.function import gramian, lyapunov_residual, transition
from undertow.control.controllers.composite_law import RCAF
from undertow.control.controllers.pid import pid
from undertow.control.controllers.rcaf import rcaf
from undertow.control.controllers.robust.estimator import Estimator
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.control.navigation.white_noise import white_noise
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.disturbances.table import table
from undertow.physics.plants.double_integrator import double_integrator
from undertow.physics.plants.linear_plant import linear_plant

pytestmark = pytest.mark.full

CONSTANTS = np.array([3.0, -20.0, 45.0, 0.5])
RISE = 1e-10  # of V(0)
FAST = {"preset": "robust", "sets": 1}


def flown(d, law=None, axes=1, limit=np.inf, goal=2.0, dt=1e-3, duration=2.0, navigation=None, loop="sampled"):
    """A run on independent axes, recorded at every step; `law` are choices of the controller."""
    plant = double_integrator(axes, limit)
    choices = dict(law or {})
    if choices.get("preset") == "robust":
        choices["sampling_time"] = dt
    run = ut.simulate(
        plant,
        rcaf(plant.model(), **({"preset": "paper"} | choices)),
        ut.references.setpoint([goal] * axes),
        disturbance=d,
        navigation=navigation,
        duration=duration,
        dt=dt,
        record=dt,
        loop=loop,
    )
    assert run.status == 0
    return run


def constant(values):
    return sinusoid(0.0, 1.0, offset=np.asarray(values))


def rising(run):
    """Whether V rose from each record to the next."""
    v = run.dataset["lyapunov"].values
    return np.diff(v) > RISE * v[0]


def hypothesis(run, name):
    return next(one for one in run.certificate["hypotheses"] if one["name"] == name)


@pytest.mark.parametrize("box", [np.inf, 46.0])
def test_paper_law_as_one_ode_never_rises(box):
    """I15, I16: constant d, with and without the box; the weights come to the box and stay certified."""
    run = flown(constant(CONSTANTS), {"weights_bound": box}, axes=4, dt=1e-4, duration=1.0, loop="continuous")
    assert not rising(run).any()
    assert run.certificate["rising"] == {"whole": 0.0, "steady": 0.0}
    assert (hypothesis(run, "weights")["whole"] < 1) == np.isfinite(box)
    held = [one for one in run.certificate["hypotheses"] if one["name"] != "weights"]
    assert all(one["whole"] == 1.0 and one["first_failure"] is None for one in held)
    v = run.dataset
    first = 0.5 * 15 * 4 * 2.0**2 + 5 * (CONSTANTS**2).sum() / 200  # at rest, five weights of zero per axis
    assert float(v["lyapunov"][0]) == pytest.approx(first, rel=1e-12)
    np.testing.assert_allclose(v["lyapunov"], v["lyapunov_tracking"] + v["lyapunov_estimation"], rtol=1e-12)


def test_its_rate_is_the_one_of_the_proof():
    """Eq. (57): with theta* = d, dV/dt = -1/2 E^T Q E - gamma_eps alpha eps^2 - s u_r - gamma_eps eps v."""
    run = flown(constant([3.0]), dt=1e-4, duration=0.5, loop="continuous")
    series, eps = run.dataset, run.dataset["modelling_error"].values[:, 0]
    s = 5 * (series["error"] - series["velocity"]).values[:, 0]
    taken = 500 * (150 * eps**2 + eps * 0.1 * np.tanh(eps / 0.5)) + s * series["robust_term"].values[:, 0]
    exact = -(series["lyapunov_decay"].values + taken)
    np.testing.assert_allclose(series["lyapunov_rate"].values[1:], (exact[1:] + exact[:-1]) / 2, rtol=2e-4)


@pytest.mark.parametrize("dt", [1e-3, 1e-2, 0.1])
def test_discrete_function_of_the_robust_law_falls_at_any_sampling_time(dt):
    """One rule: by exactly l_1 eps^2 per step, limits of the input or not (X4); the error ends at rounding."""
    run = flown(constant(CONSTANTS), FAST | {"bandwidth": 0.35 / dt}, axes=4, limit=30.0, dt=dt, duration=300 * dt)
    assert hypothesis(run, "limits")["whole"] < 1
    v, eps = run.dataset["lyapunov"].values, run.dataset["modelling_error"].values
    fall = 1 - transition(run_estimator(dt), dt, 1)[0, 0, 0]
    np.testing.assert_allclose(np.diff(v), -fall * (eps[:-1] ** 2).sum(-1), atol=1e-12 * v[0])
    assert not rising(run).any() and v[-1] < 1e-20 * v[0]


def run_estimator(dt):
    return rcaf(double_integrator(1).model(), **FAST, bandwidth=0.35 / dt, sampling_time=dt).estimator


def test_robust_law_with_five_rules_and_the_box():
    """Projection cannot make V rise (X1), even with weights at their bound."""
    run = flown(constant(CONSTANTS / 9), {"preset": "robust", "weights_bound": 5.5}, axes=4)
    assert hypothesis(run, "weights")["whole"] < 1 and hypothesis(run, "basis")["whole"] == 1
    assert not rising(run).any()


def test_with_a_tracking_share_the_whole_function_falls_but_for_the_first_tick():
    """mu = 1 / gamma_eps > 0: V_f holds 1/2 E^T P E, too. What is learnt at t = 0 counts a step later: order dt^2."""
    law, rises = {"preset": "robust", "bandwidth": 50.0, "tracking_share": 0.01}, []
    for dt in (5e-4, 2.5e-4):
        run = flown(constant([3.0]), law, dt=dt, duration=400 * dt)
        series = run.dataset
        assert "1/mu" in run.certificate["function"] and not rising(run)[1:].any()
        np.testing.assert_allclose(series["lyapunov"], series["lyapunov_tracking"] + series["lyapunov_estimation"])
        rises.append(float(series["lyapunov_rate"][1]) * dt / float(series["lyapunov"][0]))
    assert 0 < rises[1] < 1e-6 and 3.7 < rises[0] / rises[1] < 4.1
    start = 100 * 5 * 3.0**2 * float(gaussian_sets(5).basis_norm_squared()) / (2 * 50**2)  # five weights that miss by 3
    assert float(series["lyapunov"][0]) == pytest.approx(start, rel=0.03)


def test_discrete_function_comes_to_the_continuous_one():
    """W -> diag(1, 1 / w_o^2) / 2 for short sampling times, and x^T W x falls by l_1 eps^2 at all of them."""
    estimator = Estimator(gaussian_sets(5), np.array([10.0, 3.0]), np.array([1.0, 0.6]))
    for dt in (1e-5, 1e-2, 1.0):
        step, w = transition(estimator, dt, 2), gramian(estimator, dt, 2)
        left = np.swapaxes(step, 1, 2) @ w @ step - w
        np.testing.assert_allclose(left[:, 0, 0], step[:, 0, 0] - 1, rtol=1e-9)
        np.testing.assert_allclose(left[:, 1], 0, atol=1e-12)
        assert (np.linalg.eigvalsh(w) > 0).all()
    fine = gramian(estimator, 1e-6, 2)
    np.testing.assert_allclose(fine[0], np.diag([0.5, 0.5 / 100]), atol=1e-5)


def test_rises_only_where_the_basis_moves():
    """Negative control: a slow estimator errs beyond its fuzzy sets, and its function rises there only."""
    run = flown(constant(CONSTANTS), {"preset": "robust", "bandwidth": 5.0, "reach": (1.0,)}, axes=4)
    rho = (np.asarray(gaussian_sets(5).basis(run.dataset["modelling_error"].values.reshape(-1, 1))) ** 2).sum(-1)
    moved = (np.abs(rho / float(gaussian_sets(5).basis_norm_squared()) - 1) > 0.01).reshape(-1, 4).any(-1)
    up = rising(run)
    assert up.any() and not (up & ~moved[:-1]).any()
    assert hypothesis(run, "basis")["whole"] == pytest.approx(1 - moved.mean())


@pytest.mark.parametrize("preset", ["paper", pytest.param("robust", marks=pytest.mark.slow)])
def test_rises_at_a_jump_of_the_disturbance_only(preset):
    """Negative control: d jumps by 4 m/s^2 at 1 s."""
    dt, loop = (1e-4, "continuous") if preset == "paper" else (1e-3, "sampled")
    jump = table([[0.0, 1.0], [1.0 - dt / 2, 1.0], [1.0, 5.0], [2.0, 5.0]])
    run = flown(jump, {"preset": preset, "sets": 1}, goal=0.0, dt=dt, loop=loop)
    time = run.dataset["time"].values
    np.testing.assert_allclose(time[1:][rising(run)], [1.0])
    still = hypothesis(run, "constant")
    assert still["first_failure"] == pytest.approx(1.0) and still["whole"] == pytest.approx(1 - 1 / len(time))


def test_rises_under_saturation_only():
    """Negative control: 1 m/s^2 against a load of 0.9 and a target that is far; V rises only where the limit binds."""
    run = flown(constant([0.9]), limit=1.0, goal=3.0, dt=2e-3, duration=10.0, loop="continuous")
    up, bound = rising(run), run.dataset["saturated"].values[:, 0] > 0
    assert up.any() and not (up & ~bound[:-1] & ~bound[1:]).any()
    limits = hypothesis(run, "limits")
    assert limits["whole"] == pytest.approx(1 - bound.mean()) and limits["first_failure"] == 0.0


def test_weights_leave_the_interior_under_noise():
    """Drift (3.8 of the theory) brings the paper's weights to their box: the share of time inside it falls."""
    law = {"sets": 5, "reach": (0.1,), "weights_bound": 20.0}
    quiet, noisy = (flown(constant([0.5]), law, goal=0.0, navigation=s) for s in (None, white_noise(0, 0.01)))
    assert hypothesis(quiet, "weights")["whole"] == 1.0
    weights = hypothesis(noisy, "weights")
    assert weights["steady"] < weights["whole"] < 1 and weights["first_failure"] > 0.2
    assert hypothesis(noisy, "measurement")["whole"] == 0.0


def test_compensation_must_exceed_half_the_range_of_d():
    """U6, U7: d = A sin t exceeds omega_bar for all but a share 2/pi asin(omega_bar / A) of a period."""
    amplitude = 0.3
    run = flown(sinusoid(amplitude, np.pi, offset=7.0), goal=0.0, duration=2.0)
    share = hypothesis(run, "compensation_gain")["whole"]
    assert share == pytest.approx(2 / np.pi * np.arcsin(0.1 / amplitude), abs=5 / 2001)  # records at crossings
    assert hypothesis(run, "robust_gain")["whole"] == 1.0  # w_bar = 10
    assert run.certificate["decay"] < run.certificate["residual"]


def test_residual_of_table_1():
    """U9: 0.2785 (phi w_bar + phi gamma_eps omega_bar) = 8.36 per axis; none with sign."""
    model = double_integrator(2).model()
    assert lyapunov_residual(rcaf(model, preset="paper"), 2) == pytest.approx(2 * 8.354, rel=1e-3)
    assert lyapunov_residual(rcaf(model, preset="paper", switching="sign"), 2) == 0.0


def test_estimation_error_of_a_ramp_reaches_its_bound():
    """d_dot = 5: with both poles at w_o the bound is the error itself, 2 d_dot / w_o for short sampling times."""
    law = {"preset": "robust", "sets": 1, "bandwidth": 20.0}
    run = flown(table([[0.0, 0.0], [0.5, 2.5], [1.0, 5.0], [2.0, 10.0]]), law, goal=0.0, duration=2.0)
    found, allowed = run.certificate["estimation_within"], run.certificate["estimation_bound"][0]
    error = abs(float((run.dataset["estimate"] - run.dataset["uncertainty"])[-2, 0]))
    assert run.certificate["uncertainty_rate"] == [pytest.approx(5.0)]
    assert found["steady"] == 1.0 and 0.98 < error / allowed <= 1.0
    assert allowed == pytest.approx(2 * 5 / 20, rel=0.02)


def test_rank_of_a_plant_that_cannot_go_everywhere():
    plant = linear_plant([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    run = ut.simulate(plant, rcaf(plant.model(), preset="paper"), ut.references.setpoint([1, 0, 1]), duration=0.1)
    assert hypothesis(run, "rank")["whole"] == 0.0 and hypothesis(run, "demand")["whole"] < 1


def test_a_run_that_failed_counts_until_its_end():
    plant = double_integrator(1, 1.0)
    run = ut.simulate(
        plant,
        rcaf(plant.model(), preset="paper"),
        ut.references.setpoint([1.0]),
        disturbance=constant([1e6]),
        duration=2.0,
        record=1e-3,
    )
    ended = float(run.outcome.ended)
    assert run.status != 0 and ended < 2.0
    assert hypothesis(run, "limits")["steady"] is None
    json.dumps(run.certificate, allow_nan=False)


def test_theory_holds_for_a_class_made_of_a_law_and_for_no_other():
    class Renamed(RCAF):
        """The paper's law under another name."""

    law = rcaf(double_integrator(2).model(), preset="paper")
    renamed = Renamed(**vars(law))
    assert theory.theory_of(renamed).poles(0) == theory.theory_of(law).poles(0) != []
    assert theory.theory_of(pid(double_integrator(2).model())).certificate is None
