"""The nonlinear disturbance observer: decay of its error, its answer to a sinusoid, no steady error, no windup."""

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import disturbance_observer
from undertow.control.controllers.bandwidths import MARGINS, Axis, robust_bandwidths
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, two_link_arm
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

DT = 1e-2


def run(plant, law, goal, disturbance=None, duration=4.0, simulate=sampled.simulate, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return simulate(loop, duration=duration, dt=DT, record_every=1, **start)


@pytest.mark.full
def test_error_of_the_estimate_decays_exactly():
    """Chen et al. (2000), Eq. (13): e_dot = -l e for a constant load, at the sampling times e = d exp(-l k T)."""
    plant, load = double_integrator(2), np.array([1.5, -0.4])
    law = disturbance_observer(plant.model(), sampling_time=DT, bandwidth=[3.0, 20.0], tracking=2.0)
    found = run(plant, law, [0.0, 0.0], sinusoid(0.0, 1.0, offset=load.tolist()), simulate=simd_batch.simulate)
    expected = load * (1 - np.exp(-np.array([3.0, 20.0]) * found.time[:, None]))
    np.testing.assert_allclose(found.signals["estimate"], expected, atol=1e-10)
    np.testing.assert_allclose(found.signals["error"][-1, 1], 0.0, atol=1e-2)


@pytest.mark.full
def test_error_at_a_frequency_is_that_of_a_first_order_observer():
    """|e| / |d| = sqrt(w^2 / (w^2 + l^2)) in continuous time; T w = 0.01 here, so that the delay of T shows little."""
    w, pole = 1.0, 4.0
    plant = double_integrator(1)
    law = disturbance_observer(plant.model(), sampling_time=DT, bandwidth=pole, tracking=2.0)
    found = run(plant, law, [0.0], sinusoid(1.0, w), duration=40.0)
    late = found.time > 20.0
    error = np.sin(w * found.time[late]) - found.signals["estimate"][late, 0]
    assert np.abs(error).max() == pytest.approx(w / np.hypot(w, pole), rel=0.03)


@pytest.mark.full
def test_a_constant_load_leaves_no_error():
    plant = two_link_arm()
    law = disturbance_observer(plant.model(), sampling_time=DT)
    found = run(plant, law, [0.4, -0.3], sinusoid(0.0, 1.0, offset=[2.0, -1.0]), duration=20.0)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-6)


@pytest.mark.full
def test_limits_do_not_wind_up():
    """The observer knows what was applied, so that its estimate is the same with and without limits."""
    push = sinusoid(0.0, 1.0, offset=-1.0)
    estimates = []
    for limit in (1.5, 1e3):
        plant = double_integrator(1, limit=limit)
        law = disturbance_observer(plant.model(), sampling_time=DT, bandwidth=5.0, tracking=2.0, reference_frequency=0)
        found = run(plant, law, [5.0], push, duration=30.0)
        estimates.append(np.asarray(found.signals["estimate"]))
    assert np.abs(estimates[0]).max() <= 1.0 + 1e-9
    np.testing.assert_allclose(estimates[0], estimates[1], atol=1e-9)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-6)


def test_the_first_order_rule_keeps_the_margin_of_the_delay():
    """The open loop of the chosen gains, written out anew, keeps the first and the fifth of the margins."""
    dt, lag = 1e-2, 0.1
    axis = Axis(dt, lag, 35.0, 0.0, 2e-3, 1.0, 6.0)
    actuators, bandwidth, tracking = robust_bandwidths(axis, 1)
    frequency = np.geomspace(1e-2, 300.0, 4000)
    s, z = 1j * frequency, np.exp(1j * frequency * dt)
    a, kept, lead = np.exp(-bandwidth * dt), np.exp(-dt / lag), lag * actuators
    force = (1 - kept) * lead / (z - kept - (1 - kept) * (1 - lead))
    given = (1 - lead) * force + lead
    # u = given (demand), d_hat (z - a) = (1 - a) / T (z - 1) v - (1 - a) force u_demand
    demand = (tracking**2 / s**2 + 2 * tracking / s + (1 - a) / dt * (z - 1) / (z - a) / s) / (
        1 - (1 - a) / (z - a) * force
    )
    held = (1 - np.exp(-s * dt)) / (s * dt)
    for factor, _, delay, largest in (MARGINS[0], MARGINS[4]):
        loop = demand * given * held * np.exp(-s * delay * axis.unknown_delay) / (1 + s * factor * lag)
        assert np.abs(1 / (1 + loop)).max() <= largest * 1.01


@pytest.mark.parametrize(("key", "value"), [("bandwidth", 0.0), ("tracking", -1.0), ("damping", [1.0, 2.0])])
def test_gains_that_no_observer_can_have(key, value):
    with pytest.raises(BadInput, match=key):
        disturbance_observer(double_integrator(6).model(), **{key: value})


@pytest.mark.full
def test_jumps_pass_the_filter_only_where_there_is_one():
    plant = double_integrator(1)
    law = disturbance_observer(plant.model(), sampling_time=DT, bandwidth=4.0, tracking=3.0, reference_frequency=0.0)
    assert law.actuation.filter is None
    first = run(plant, law, [1.0], duration=0.1).signals["input"][0]
    np.testing.assert_allclose(first, jnp.array([9.0]), rtol=1e-12)  # w^2 times the jump
