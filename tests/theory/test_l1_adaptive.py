"""L1 adaptive control: the bound of the predictor's error, what a constant load leaves, and a limit case."""

import numpy as np
import pytest

from undertow.control.controllers import disturbance_observer, l1_adaptive
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, two_link_arm
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop


def run(plant, law, goal, disturbance=None, duration=4.0, dt=1e-2, simulate=sampled.simulate, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return simulate(loop, duration=duration, dt=dt, record_every=1, **start)


@pytest.mark.full
@pytest.mark.parametrize("dt", [1e-2, 2e-3])
def test_error_of_the_predictor_is_bounded_by_the_sampling_time(dt):
    """|v_tilde| <= T max |d|, whatever the gains: Hovakimyan and Cao (2010), section 3.3, with a scalar A_s."""
    plant, amplitude, w = double_integrator(1), 2.0, 3.0
    law = l1_adaptive(plant.model(), sampling_time=dt, predictor=5.0, bandwidth=8.0, tracking=2.0)
    found = run(plant, law, [0.0], sinusoid(amplitude, w), dt=dt, simulate=simd_batch.simulate)
    error = np.abs(found.signals["modelling_error"][:, 0])
    assert error.max() <= amplitude * dt * (1 + 1e-9)
    assert error.max() > 0.99 * amplitude * dt  # the bound is tight where the load is largest


@pytest.mark.full
def test_a_constant_load_gives_the_bound_itself_and_leaves_a_known_share():
    """v_tilde = -d T, the compensation settles at d a T / (exp(a T) - 1), and the rest over w^2 is the error."""
    dt, rate, w, load = 1e-2, 20.0, 2.0, 1.5
    plant = double_integrator(1)
    law = l1_adaptive(plant.model(), sampling_time=dt, predictor=rate, bandwidth=8.0, tracking=w)
    found = run(plant, law, [0.0], sinusoid(0.0, 1.0, offset=load), duration=20.0)
    np.testing.assert_allclose(found.signals["modelling_error"][1:, 0], -load * dt, rtol=1e-9)
    share = rate * dt / np.expm1(rate * dt)
    np.testing.assert_allclose(found.signals["estimate"][-1, 0], load * share, rtol=1e-9)
    np.testing.assert_allclose(np.abs(found.signals["error"][-1, 0]), load * (1 - share) / w**2, rtol=1e-6)


@pytest.mark.full
def test_with_a_slow_predictor_it_is_the_disturbance_observer():
    """For a_s T to 0 the filter of sigma_hat is the first-order observer of the same bandwidth."""
    plant, load = two_link_arm(), sinusoid(1.0, 2.0, offset=[1.0, -0.5])
    same = {"sampling_time": 1e-2, "bandwidth": [5.0, 9.0], "tracking": 2.5}
    adaptive = run(plant, l1_adaptive(plant.model(), predictor=1e-8, **same), [0.3, -0.2], load)
    observer = run(plant, disturbance_observer(plant.model(), **same), [0.3, -0.2], load)
    np.testing.assert_allclose(adaptive.signals["estimate"], observer.signals["estimate"], atol=1e-6)
    np.testing.assert_allclose(adaptive.signals["error"], observer.signals["error"], atol=1e-8)


@pytest.mark.full
def test_limits_do_not_wind_up():
    """The predictor knows what was applied: its error stays within the bound at the limits, too."""
    plant = double_integrator(1, limit=1.5)
    law = l1_adaptive(plant.model(), sampling_time=1e-2, tracking=2.0, reference_frequency=0)
    found = run(plant, law, [5.0], sinusoid(0.0, 1.0, offset=-1.0), duration=30.0)
    assert np.abs(found.signals["modelling_error"]).max() <= 1e-2 * (1 + 1e-9)
    assert found.signals["attained_share"].min() < 0.5  # limits did bind
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=2e-3)


@pytest.mark.parametrize(("key", "value"), [("predictor", 0.0), ("bandwidth", -1.0), ("tracking", [1.0, 2.0])])
def test_gains_that_the_law_cannot_have(key, value):
    with pytest.raises(BadInput, match=key):
        l1_adaptive(double_integrator(6).model(), **{key: value})
