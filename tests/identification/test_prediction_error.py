"""A filter follows disturbed dives: its gains, the likelihood of noise, and numbers that forces do not spoil."""

import functools
import json

import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.studies.identification.dive import SENSOR_OF_RESIDUAL, dive_of
from undertow.studies.identification.estimates import _packed, _unpacked
from undertow.studies.identification.fit import completed, scores_of, weights_of
from undertow.studies.identification.free_parameters import chosen, parameters_of
from undertow.studies.identification.identified_vehicle import MotionState, prior_vehicle
from undertow.studies.identification.kalman_gains import Disturbance, unlikelihood, with_filter
from undertow.studies.identification.model import NUISANCES, Unknowns, model_of
from undertow.studies.identification.output_error import fit
from undertow.studies.identification.prediction import DisturbedMotion, between, disturbed
from undertow.studies.identification.prediction_error import filter_fit
from undertow.studies.identification.profile_likelihood import names_in, profile_intervals
from undertow.studies.identification.segments import START_DEVIATION, segments_of
from undertow.studies.identification.simulated_dive import random_wrenches, telegraph_dive
from undertow.studies.identification.uncertainty import uncertainty_of

STEP, DURATION = 0.05, 40.0
FREE = ("quadratic_damping", "lag")
TRUTH = {"quadratic_damping.surge": 110.0, "quadratic_damping.yaw": 2.0, "lag": 1.3}
DEVIATIONS = np.repeat([4.0, 0.4], 3)  # N, N m


class Problem:
    """A vehicle with few free numbers, and a dive of it, which unknown forces may push."""

    def __init__(self, deviations, free=FREE, is_ratio=None):
        plant = hybrid_vehicle(bluerov2_heavy(), t200())
        self.parameters = chosen(parameters_of(plant), free)
        if is_ratio is not None:  # a deviation of 30 % in the number or in its logarithm
            change = {True: lambda p: 0.3, False: lambda p: 0.3 * p.prior}[is_ratio]
            self.parameters = [p._replace(is_ratio=is_ratio, deviation=change(p)) for p in self.parameters]
        self.model = model_of(prior_vehicle(plant), self.parameters)
        pushes = random_wrenches(np.random.default_rng(1), DURATION, deviations, 2.0)
        log = telegraph_dive(plant, TRUTH, 5, DURATION, disturbance=pushes)
        self.segments = segments_of([dive_of(log, log["input"], STEP)], 10.0)
        self.least = Unknowns(tuple(self.parameters), 1).least()
        self.free = fit(self.model, self.segments, STEP, np.zeros(len(self.least)), self.least)

    @functools.cached_property
    def filtered(self):
        return filter_fit(self.model, self.segments, STEP, self.free.z, self.least, self.free.noise)

    def uncertainty(self, estimate):
        return uncertainty_of(estimate.information, scores_of(self.model, STEP, estimate), STEP)

    def intervals(self, estimate):
        found = self.uncertainty(estimate).intervals(self.parameters, estimate.z)
        return {interval.parameter.name: interval for interval in found}

    def profiles(self, estimate, names):
        reaches = self.uncertainty(estimate).reaches(self.parameters)
        say = lambda stage: None
        return profile_intervals(self.model, STEP, estimate, self.least, self.parameters, reaches, names, say)


@pytest.fixture(scope="module")
def pushed():
    with in_precision("float64"):
        yield Problem(DEVIATIONS)


def test_a_change_leads_from_one_state_to_the_other():
    with in_precision("float64"):
        attitude = jnp.array([0.8, 0.2, -0.4, 0.4])
        motion = MotionState(jnp.arange(3.0), attitude / jnp.linalg.norm(attitude), jnp.arange(6.0) / 10, ())
        x = DisturbedMotion(motion, jnp.ones(6))
        change = 1e-5 * jnp.arange(1.0, 19.0)
        np.testing.assert_allclose(between(x, disturbed(x, change)), change, atol=1e-13)


@pytest.mark.full
def test_gains_are_those_of_a_kalman_filter(pushed):
    """Beside the filter in its first form, with an inverse, for the transitions that it had."""
    disturbance = Disturbance(np.repeat([0.2, 0.8], 3), 1.5)
    weights = weights_of(pushed.segments, pushed.free.noise, np.ones(pushed.free.shares.shape))
    _, run = with_filter(pushed.model, pushed.free.z, pushed.segments, weights, disturbance, STEP)
    measured = np.vstack([np.eye(12, 18), np.eye(12, 18)[2]])
    covariance = np.diag(np.concatenate([START_DEVIATION, disturbance.deviations]) ** 2)
    grown = np.zeros(18)
    grown[12:] = (1 - np.exp(-2 * STEP / 1.5)) * disturbance.deviations**2
    offsets = pushed.segments.offsets[1][:, SENSOR_OF_RESIDUAL]
    for k in range(120):
        transition, there = run.transitions[1, k], weights[1, k] > 0
        part = ((1 - offsets[k])[:, None] * measured + offsets[k][:, None] * (measured @ transition))[there]
        gain = np.zeros((18, 13))
        innovation = part @ covariance @ part.T + np.diag(1 / weights[1, k][there])
        gain[:, there] = covariance @ part.T @ np.linalg.inv(innovation)
        updated = covariance - gain[:, there] @ part @ covariance  # at the begin of the step, then over the step
        covariance = transition @ updated @ transition.T + np.diag(grown)
        np.testing.assert_allclose(run.gains[1, k], transition @ gain, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(run.transitions[1, 3][12:, 12:], np.exp(-STEP / 1.5) * np.eye(6), atol=1e-12)


@pytest.mark.full
def test_the_likelihood_of_other_noise_needs_no_other_run(pushed):
    near = Disturbance(np.repeat([0.2, 0.8], 3), 1.5)
    far = Disturbance(np.repeat([0.1, 0.5], 3), 4.0)
    ones = np.ones(pushed.free.shares.shape)
    weights = weights_of(pushed.segments, pushed.free.noise, ones)
    other = weights_of(pushed.segments, 1.5 * pushed.free.noise, ones)
    runs = [with_filter(pushed.model, pushed.free.z, pushed.segments, weights, d, STEP)[1] for d in (near, far)]
    values = [
        float(unlikelihood(far, jnp.asarray(other), run, float(d.kept(STEP)), STEP))
        for run, d in zip(runs, (near, far), strict=True)
    ]
    assert values[0] == pytest.approx(values[1], rel=2e-4)
    assert abs(float(unlikelihood(near, jnp.asarray(weights), runs[0], float(near.kept(STEP)), STEP)) - values[0]) > 10


@pytest.mark.full
def test_forces_that_no_log_has_spoil_free_runs_and_not_the_filter(pushed):
    free, filtered = pushed.intervals(pushed.free), pushed.intervals(pushed.filtered)
    assert pushed.filtered.converged
    errors = {name: (abs(free[name].value - truth), abs(filtered[name].value - truth)) for name, truth in TRUTH.items()}
    assert all(filtered[name].low < truth < filtered[name].high for name, truth in TRUTH.items())
    assert sum(after / before for before, after in errors.values()) / len(errors) < 0.5
    assert all(filtered[name].deviation < 0.6 * free[name].deviation for name in TRUTH)
    found = pushed.filtered.disturbance
    mass = np.diagonal(np.asarray(pushed.model.candidate(jnp.asarray(pushed.filtered.z)).vehicle.body.mass_matrix))
    np.testing.assert_allclose(found.deviations * mass / DEVIATIONS, 1.0, atol=0.45)
    assert 1.0 < found.correlation_time < 4.0


@pytest.mark.full
def test_innovations_are_nearly_white(pushed):
    white = pushed.filtered.residuals[pushed.filtered.weights > 0]
    assert white.std() == pytest.approx(1.0, abs=0.05)
    is_there = pushed.filtered.weights[:, :, 9] > 0
    both = is_there[:, 1:] & is_there[:, :-1]
    next_to = lambda gyro: np.corrcoef(gyro[:, 1:][both], gyro[:, :-1][both])[0, 1]
    assert next_to(pushed.free.residuals[:, :, 9]) > 0.9
    assert abs(next_to(pushed.filtered.residuals[:, :, 9])) < 0.12


@pytest.mark.full
def test_a_kept_solution_gives_the_same_estimate(pushed):
    answer = json.loads(json.dumps(_packed(pushed.filtered)))
    again = completed(pushed.model, pushed.segments, STEP, _unpacked(answer))
    for name in ("z", "weights", "information", "residuals", "cost"):
        np.testing.assert_array_equal(getattr(again, name), getattr(pushed.filtered, name), err_msg=name)


@pytest.mark.full
def test_without_a_disturbance_both_methods_agree():
    with in_precision("float64"):
        calm = Problem(np.zeros(6))
        deviations = np.sqrt(np.diagonal(np.linalg.inv(calm.free.information)))
        assert (np.abs(calm.filtered.z - calm.free.z) / deviations).max() < 1.0
        assert len(calm.free.z) == len(calm.parameters) + len(NUISANCES)
        assert (calm.filtered.disturbance.deviations < np.repeat([0.02, 0.05], 3)).all()


def test_another_method_is_refused():
    scenario = {"plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}}}
    log = telegraph_dive(hybrid_vehicle(bluerov2_heavy(), t200()), {}, 1, 3.0)
    with pytest.raises(ut.BadInput, match=r"`method` must be one of .*prediction_error.*, but is kalman"):
        ut.identify(scenario, log, method="kalman")


@pytest.mark.full
def test_a_profile_is_the_usual_interval_where_the_cost_is_a_parabola(pushed):
    """As for the filter; output error is bent, and its interval not."""
    names = ["quadratic_damping.surge", "quadratic_damping.yaw"]
    usual, profiles = pushed.intervals(pushed.filtered), pushed.profiles(pushed.filtered, names)
    assert list(profiles) == names
    for name in names:
        np.testing.assert_allclose(profiles[name], (usual[name].low, usual[name].high), rtol=0.02)


@pytest.mark.full
def test_a_profile_does_not_depend_on_how_a_number_is_written():
    """Of the logarithm of a number and of the number itself; usual intervals differ."""
    name = "quadratic_damping.sway"
    with in_precision("float64"):
        plain, ratio = (Problem(3 * DEVIATIONS, (name,), is_ratio) for is_ratio in (False, True))
        usual = [problem.intervals(problem.free)[name] for problem in (plain, ratio)]
        ends = [problem.profiles(problem.free, [name])[name] for problem in (plain, ratio)]
    assert abs(usual[0].low / usual[1].low - 1) > 0.05
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.025)


def test_a_profile_of_what_is_not_free_is_refused():
    known = parameters_of(hybrid_vehicle(bluerov2_heavy(), t200()))
    free = chosen(known, ("quadratic_damping", "lag"))
    assert names_in(free, ["*.yaw", "lag"]) == ["quadratic_damping.yaw", "lag"]
    with pytest.raises(ut.BadInput, match=r"`profile` must name free parameters, but is quadratic_damping.ya"):
        names_in(free, ["quadratic_damping.ya"])
