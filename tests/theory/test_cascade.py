"""The cascade of autopilots: its equal as a PID, its limits, and the published gains with their units."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import cascade, pid
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, hybrid_vehicle, two_link_arm
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

DT = 1e-2


def run(plant, law, goal, disturbance=None, duration=4.0, simulate=sampled.simulate, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return simulate(loop, duration=duration, dt=DT, record_every=1, **start)


@pytest.mark.full
def test_without_limits_it_is_a_pid():
    """k_p = k p + k_i, k_i p and k; from a start without error, where both integrals begin with the same."""
    plant, load = two_link_arm(), sinusoid(2.0, 3.0, offset=[1.0, -0.5])
    p, k, i = 1.2, 6.0, 2.5
    nested = cascade(plant.model(), sampling_time=DT, outer=p, inner=k, integral=i)
    flat = pid(plant.model(), sampling_time=DT, gains=(k * p + i, i * p, k))
    found, expected = (run(plant, law, [0.0, 0.0], load).signals["error"] for law in (nested, flat))
    size = float(np.abs(expected).max())
    np.testing.assert_allclose(found, expected, atol=0.02 * size)  # the integral of e_dot by Euler's method is not e
    assert size > 0.05


def test_its_own_gains_have_the_poles_of_pid():
    """(p + w)^2 p + w^3 / 10 = 0 for frequency w: the characteristic polynomials agree."""
    model = double_integrator(1, limit=5.0).model()
    law, like = cascade(model, sampling_time=DT), pid(model, sampling_time=DT)
    p, k, i = (float(one) for one in (law.outer, law.inner, law.integral))
    found = [1.0, k, k * p + i, i * p]
    np.testing.assert_allclose(found, [1.0, *(float(g) for g in (like.derivative, like.proportional, like.integral))])


@pytest.mark.full
def test_a_far_goal_is_approached_at_the_limit_of_the_rate():
    plant = double_integrator(1)
    law = cascade(
        plant.model(), sampling_time=DT, outer=1.0, inner=8.0, integral=0.0, rate_limit=0.5, reference_frequency=0.0
    )
    found = run(plant, law, [10.0], duration=40.0, simulate=simd_batch.simulate)
    speed = found.signals["velocity"][:, 0]
    half = (found.time > 8.0) & (found.time < 15.0)
    np.testing.assert_allclose(speed[half], 0.5, rtol=1e-6)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-4)


@pytest.mark.full
def test_the_derivative_is_the_slope_of_the_error_of_the_rate():
    """For an error of the rate that falls by s per second the derivative settles at -k_d s, whatever the filter."""
    law = cascade(
        double_integrator(1).model(),
        sampling_time=DT,
        outer=1.0,
        inner=1.0,
        integral=0.0,
        derivative=0.3,
        derivative_filter=20.0,
        reference_frequency=0.0,
    )
    still, slope = jnp.zeros(1), 0.7
    goal = Target(still, still, still)

    def step(z, k):
        y = Measurement(still, slope * DT * k[None])
        u, _ = law.command(z, y, goal)
        return law.advance(z, y, goal, u, jnp.asarray(DT)), u[0]

    inputs = jax.lax.scan(step, law.init(Measurement(still, still), goal), jnp.arange(200.0))[1]
    np.testing.assert_allclose(inputs[-1], -slope * DT * 199 - 0.3 * slope, rtol=1e-9)


def test_gains_of_ardusub_with_their_units():
    """A demand of 1 is `authority`: 0.785 g makes the horizontal gains those of the parameters, in SI units."""
    model = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0)).model()
    most = np.array([math.pi / 4 * 9.80665] * 2 + [10.0] + [100.0, 100.0, 50.0])
    law = cascade(model, preset="ardusub", sampling_time=DT, authority=most)
    np.testing.assert_allclose(law.outer, [1, 1, 3, 6, 6, 6])  # PSC_POSXY_P, PSC_POSZ_P, ATC_ANG_*_P
    # h = 0.1 10 = 1 halves PSC_VELZ_P = 8; ATC_RAT_*_P times 100 and 50.
    np.testing.assert_allclose(law.inner, [6, 6, 4, 13.5, 13.5, 9])
    np.testing.assert_allclose(law.integral, [0.5, 0.5, 8 * 0.02 * 10 / 2, 9, 9, 0.9])
    np.testing.assert_allclose(law.derivative, [0, 0, 0, 0.36, 0.36, 0])
    np.testing.assert_allclose(law.rate_limit, [1, 1, 1, np.inf, np.inf, math.pi])


def test_the_demand_of_one_is_full_thrust_of_all_thrusters_of_an_axis():
    """From the model: of four inclined thrusters in surge, of four vertical ones in heave, in the stronger direction."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0))
    law = cascade(plant.model(), preset="px4", sampling_time=DT)
    most = np.asarray(law.inner) / [0.2, 0.2, 0.2, 1.5, 2.0, 2.0]
    held = plant.model().in_body_axes().actuators.quasi_static()
    full = float(held.force((), jnp.asarray(16.0)))
    gain = np.abs(np.asarray(plant.model().in_body_axes().dynamics.acceleration_per_thrust))
    np.testing.assert_allclose(most, full * gain.sum(1), rtol=1e-6)
    np.testing.assert_allclose(law.limit, [0.1, 0.1, 0.1, 0.3, 0.3, 0.3] * most)
    assert not law.actuation.feedforward
    # Where nothing limits the inputs, a demand of one is that of this vehicle at 16 V.
    endless = hybrid_vehicle(bluerov2_heavy(), t200(supply=np.inf)).model()
    usual = cascade(endless, preset="px4", sampling_time=DT, saturation=(0.2, 0.5))
    np.testing.assert_allclose(np.asarray(usual.inner) / [0.2, 0.2, 0.2, 1.5, 2.0, 2.0], most, rtol=0.01)
    np.testing.assert_allclose(usual.limit / law.limit, np.repeat([2.0, 5 / 3], 3), rtol=0.01)
    np.testing.assert_allclose(law.outer, [5, 5, 5, 4 / 1.5, 2, 2])


@pytest.mark.full
def test_nothing_removes_a_constant_load_with_the_gains_of_px4():
    """UUV_GAIN_Z_P = 1: the error is the load over the authority."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200("ideal", supply=16.0, dead_zone=0.0))
    law = cascade(plant.model(rate_term=True), preset="px4", sampling_time=DT, authority=8.0, saturation=[1, 1])
    kept = plant.model(rate_term=True).in_body_axes()
    still = kept.coordinates.measurement(jnp.zeros(6), jnp.zeros(6))
    load = 0.4
    push = sinusoid(0.0, 1.0, offset=[0.0, 0.0, load, 0.0, 0.0, 0.0])
    found = run(plant, law, [0.0] * 6, push, duration=60.0)
    weight = float(kept.dynamics.drift(still)[2])
    np.testing.assert_allclose(abs(float(found.signals["error"][-1, 2])), abs(load + weight) / 8.0, rtol=1e-3)


@pytest.mark.full
def test_limits_do_not_wind_up():
    plant = double_integrator(1, limit=1.5)
    law = cascade(plant.model(), sampling_time=DT, outer=0.7, inner=4.0, integral=1.0, reference_frequency=0.0)
    found = run(plant, law, [5.0], sinusoid(0.0, 1.0, offset=-1.0), duration=60.0)
    np.testing.assert_allclose(found.signals["estimate"][-1], -1.0, atol=1e-3)
    assert -float(found.signals["error"].min()) < 0.5
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-4)


@pytest.mark.parametrize("preset", ["ardusub", "px4"])
def test_presets_of_autopilots_are_for_vehicles(preset):
    with pytest.raises(BadInput, match="preset"):
        cascade(two_link_arm().model(), preset=preset)


@pytest.mark.parametrize(("key", "value"), [("outer", 0.0), ("integral", -1.0), ("rate_limit", [1.0, 2.0])])
def test_gains_that_no_cascade_can_have(key, value):
    with pytest.raises(BadInput, match=key):
        cascade(double_integrator(6).model(), **{key: value})
