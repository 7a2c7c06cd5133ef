"""What a step of the grid does to samples and to lags: closed forms."""

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.numerics.integrators import rk4
from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.studies.identification.dive import Dive, dive_of
from undertow.studies.identification.free_parameters import chosen, parameters_of, resolved_by
from undertow.studies.identification.identified_vehicle import MotionState, prior_vehicle
from undertow.studies.identification.prediction import _differences
from undertow.studies.identification.residual_noise import outlier_shares
from undertow.studies.identification.simulated_dive import simulated_log
from undertow.studies.identification.uncertainty import Uncertainty

STEP = 0.05


@pytest.fixture(scope="module")
def plant():
    with in_precision("float64"):
        return hybrid_vehicle(bluerov2_heavy(), t200())


def predicted_surge(begin, end, early, late, shares):
    """Mean surge velocity of samples in a step that lasts 1 s, from states and second derivatives."""
    with in_precision("float64"):
        state = lambda u: MotionState(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), jnp.zeros(6).at[0].set(u), ())
        curve = lambda u: MotionState(jnp.zeros(3), jnp.zeros(4), jnp.zeros(6).at[0].set(u), ())
        offsets, spreads = jnp.full(5, np.mean(shares)), jnp.full(5, np.var(shares))
        measured = jnp.zeros(14).at[3].set(1.0)
        rows = (state(begin), state(end), curve(early), curve(late), measured, offsets, spreads)
        return float(_differences(*rows, jnp.zeros(3), 1.0)[6])


def test_mean_of_samples_on_a_parabola():
    """u = 1 + 2 s + 3 s^2 over a step, sampled at three shares s: the mean of the samples is predicted exactly."""
    shares = np.array([0.1, 0.35, 0.9])
    motion = lambda s: 1 + 2 * s + 3 * s**2
    assert predicted_surge(motion(0.0), motion(1.0), 6.0, 6.0, shares) == pytest.approx(
        motion(shares).mean(), rel=1e-12
    )


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_a_sample_on_a_cubic(share):
    """u = s^3, with the derivatives 0 and 3 at both ends: 2 (1 - 0) and 2 (3 - 1) are the curves that they give."""
    assert predicted_surge(0.0, 1.0, 2.0, 4.0, [share]) == pytest.approx(share**3, rel=1e-12)


def test_a_step_knows_how_its_samples_are_spread(plant):
    """Variance of the times of samples in each step, against NumPy, and parts of a dive keep their rows."""
    with in_precision("float64"):
        generator = np.random.default_rng(1)
        log = simulated_log(prior_vehicle(plant).with_values({}), np.zeros((400, 8)), generator)
        dive = dive_of(log, log["input"], STEP)
    time = (log["angular_velocity"].time - dive.start) / STEP
    for step in (10, 25, 40):
        inside = time[(time >= step) & (time < step + 1)] - step
        assert dive.counts[step, 3] == len(inside) > 1
        assert dive.spreads[step, 3] == pytest.approx(inside.var(), abs=1e-12)
    part: Dive = dive.part("part", 10, 20)
    assert part.start == pytest.approx(dive.start + 10 * STEP)
    np.testing.assert_array_equal(part.spreads, dive.spreads[10:30])


def test_a_lag_is_no_shorter_than_a_step_can_show(plant):
    """Three quarters of a step, of the 0.1 s of a T200; a shorter step allows a shorter lag."""
    known = chosen(parameters_of(plant), ["lag", "mass"])
    least = {}
    for step in (0.05, 0.02):
        lag, mass = resolved_by(step, plant, known)
        least[step] = lag.least
        assert lag.value(lag.least_z) == pytest.approx(lag.least) and mass.least_z == -np.inf
    assert least[0.05] == pytest.approx(0.375, abs=0.001)
    assert least[0.02] == pytest.approx(0.4 * least[0.05])


def test_a_lag_is_no_surer_than_a_step_allows(plant):
    """The lag whose exact decay over a step is that of a fourth-order step of the true one; intervals know it."""
    step, lag = 0.05, float(plant.thruster.actuator_model(8, False).time_constant())
    coarse = rk4(lambda t, x: -x / lag, 0.0, jnp.ones(()), step)
    compensating = -step / np.log(float(coarse))
    known = resolved_by(step, plant, chosen(parameters_of(plant), ["lag", "mass"]))
    expected = abs(np.log(compensating / lag))
    assert known[0].resolution == pytest.approx(expected, rel=0.01) and known[1].resolution == 0.0
    sure = Uncertainty(1e-12 * np.eye(2), 1e6, np.ones(2), 0.0)
    of_lag, of_mass = sure.intervals(known, np.zeros(2))
    assert of_lag.deviation == pytest.approx(expected, rel=0.01) and of_mass.share == pytest.approx(1e-6)


def test_a_smooth_misfit_has_no_outliers_and_a_spike_is_one():
    """What a model lacks moves samples together, however fast; a spike beyond three deviations counts by its share."""
    time = np.linspace(0, 1, 400)
    smooth = np.where(time < 0.5, 0.01 * time, np.sin(40 * time))
    residuals = np.zeros((1, 400, 13))
    residuals[0, :, 11] = smooth
    counts = np.ones((1, 400, 13))
    assert np.all(outlier_shares(residuals, counts) == 1.0)
    residuals[0, 100, 11] = 50.0
    shares = outlier_shares(residuals, counts)
    assert shares[0, 100, 11] < 0.1 and np.sum(shares < 1) == 1
