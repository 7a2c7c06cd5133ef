"""First estimates by the weak form: known numbers of simulated dives, signs and order of the thrusters."""

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.studies.identification.dive import Dive, dive_of
from undertow.studies.identification.free_parameters import axis_parameters, chosen, parameters_of
from undertow.studies.identification.gap_filling import filled
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.input_signs import input_gains
from undertow.studies.identification.simulated_dive import simulated_log, telegraph_dive
from undertow.studies.identification.weak_form import first_estimate
from undertow.studies.identification.weak_problem import weak_problem

TRUTH = {"added_mass.surge": 9.0, "quadratic_damping.sway": 160.0, "net_buoyancy": 3.0, "r_b.z": -0.02}
STEP = 0.05


@pytest.fixture(scope="module")
def plant():
    with in_precision("float64"):
        return hybrid_vehicle(bluerov2_heavy(), t200("static"))


@pytest.fixture(scope="module")
def log(plant):
    with in_precision("float64"):
        return telegraph_dive(plant, TRUTH, 2)


def test_functions_have_integral_one_and_the_slope_of_a_ramp():
    """Closed forms: the mean of 1 is 1, the integral of the derivative times t is minus that of the function."""
    count = round(20 / STEP)
    present = np.ones((count, 5), dtype=int)
    values = np.zeros((count, 14))
    values[:, 3] = 1.0
    dive = Dive("still", 0.0, STEP, np.zeros((count, 8)), values, 0.5 * present, 0.0 * present, present)
    problem = weak_problem([dive])
    time = STEP * np.arange(problem.test.shape[1])
    np.testing.assert_allclose(problem.test.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(problem.slope.sum(axis=1), 0.0, atol=1e-9)
    np.testing.assert_allclose(problem.slope @ time, -1.0, rtol=1e-9)


def test_velocities_come_from_poses_where_there_are_no_others():
    """A turn at a constant rate, and a constant speed ahead."""
    count = 200
    time = STEP * (np.arange(count) + 0.5)
    yaw = 0.3 * time
    values = np.zeros((count, 14))
    values[:, 0], values[:, 1] = 0.5 / 0.3 * np.sin(yaw), -0.5 / 0.3 * np.cos(yaw)
    values[:, 3], values[:, 6] = np.cos(yaw / 2), np.sin(yaw / 2)
    counts = np.zeros((count, 5), dtype=int)
    counts[:, :2] = 1
    dive = Dive(
        "circle", 0.0, STEP, np.zeros((count, 8)), values, 0.5 * np.ones((count, 5)), np.zeros((count, 5)), counts
    )
    moving = filled(dive).values[2:-2, 7:13]
    np.testing.assert_allclose(moving, np.tile([0.5, 0, 0, 0, 0, 0.3], (len(moving), 1)), atol=1e-4)


@pytest.mark.full
def test_the_estimate_is_near_the_truth(plant, log):
    with in_precision("float64"):
        parameters = chosen(parameters_of(plant))
        estimate = first_estimate(prior_vehicle(plant), parameters, [dive_of(log, log["input"], STEP)])
    truth = {parameter.name: TRUTH.get(parameter.name, parameter.prior) for parameter in parameters}
    assert (estimate.explained > 0.95).all()
    for name in TRUTH:
        assert abs(estimate.values[name] - truth[name]) < 4 * estimate.deviations[name] + 0.1 * abs(truth[name]), name
    inside = [
        abs(estimate.values[name] - value) < 3 * estimate.deviations[name] + 0.05 * abs(value)
        for name, value in truth.items()
    ]
    assert np.mean(inside) > 0.9
    assert (np.abs(estimate.z) <= 2.0).all()


@pytest.mark.full
def test_equations_of_what_was_not_measured_are_left_out(plant, log):
    with in_precision("float64"):
        dive = dive_of(log, log["input"], STEP)
        counts = dive.counts.copy()
        counts[:, [0, 2]] = 0
        dive = dive._replace(counts=counts)
        estimate = first_estimate(prior_vehicle(plant), chosen(parameters_of(plant)), [dive])
    assert np.isnan(estimate.explained[:3]).all()
    assert estimate.explained[5] > 0.9
    assert estimate.values["added_mass.heave"] == pytest.approx(
        float(plant.vehicle.added_mass[2, 2]), abs=estimate.deviations["added_mass.heave"]
    )


@pytest.mark.full
def test_signs_and_swapped_thrusters(plant, log):
    def gains(change):
        inputs = log["input"]
        dive = dive_of(log, inputs._replace(values=change(inputs.values.copy())), STEP)
        return input_gains(prior_vehicle(plant), parameters, [dive])

    with in_precision("float64"):
        parameters = chosen(parameters_of(plant))
        sound = gains(lambda values: values)
        assert sound.findings == ()
        np.testing.assert_allclose(sound.gains, 1.0, atol=0.1)
        turned = gains(lambda values: values * [1, 1, -1, 1, 1, 1, 1, 1])
        assert [finding.name for finding in turned.findings] == ["T3"]
        assert turned.gains[2] == pytest.approx(-1.0, abs=0.15)
        swapped = gains(lambda values: values[:, [0, 5, 2, 3, 4, 1, 6, 7]])
        assert swapped.swapped == ((1, 5),)
        both = gains(lambda values: values[:, [5, 1, 2, 3, 4, 0, 6, 7]] * [1, 1, -1, 1, 1, 1, 1, 1])
        assert both.swapped == ((0, 5),)
        assert "T3" in [finding.name for finding in both.findings]


@pytest.mark.full
def test_a_thruster_that_does_nothing(plant):
    with in_precision("float64"):
        generator = np.random.default_rng(7)
        volts = np.repeat(generator.choice([-8.0, 0.0, 8.0], (60, 8)), 100, axis=0)
        dead = prior_vehicle(plant).with_values({"thruster_gain.T4": jnp.asarray(1e-6)})
        log = simulated_log(dead, volts, generator)
        found = input_gains(prior_vehicle(plant), chosen(parameters_of(plant)), [dive_of(log, log["input"], STEP)])
    assert [finding.name for finding in found.findings] == ["T4"]
    assert "no effect" in found.findings[0].sentence


@pytest.mark.full
def test_inputs_along_the_axes(plant, log):
    """Wrenches as inputs: the gain of each axis, and an axis that pushes the other way."""
    with in_precision("float64"):
        volts = log["input"].values
        thrust = np.asarray(plant.thruster.thrust(plant.thruster.initial_state(8), jnp.asarray(volts)))
        wrenches = thrust @ np.asarray(plant.thruster_matrix).T / (50.0 * np.array([1, 1, 1, 0.2, 0.2, 0.2]))
        inputs = log["input"]._replace(values=wrenches * [1, 1, -1, 1, 1, 1], columns=())
        parameters = chosen(parameters_of(plant) | axis_parameters(lag=0.01))
        found = input_gains(prior_vehicle(plant, True), parameters, [dive_of(log, inputs, STEP)])
    assert [finding.name for finding in found.findings] == ["heave"]
    np.testing.assert_allclose(np.abs(found.gains), 1.0, atol=0.25)
