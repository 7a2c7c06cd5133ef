"""The PID baseline: pole placement, what its integral learns, limits, motors, other plants."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from undertow.control.controllers import pid
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, hybrid_vehicle, inverted_pendulum, magnetic_levitation
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop


def run(plant, law, goal, disturbance=None, duration=20.0, dt=1e-2, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)


@pytest.mark.full
def test_error_follows_the_placed_poles():
    """e, e_dot and the integral under x_ddot = u + d: the matrix exponential, to the order of the sampling time."""
    law = pid(double_integrator(1).model(), frequency=2.0, damping=0.7, integral_share=0.2, reference_frequency=0.0)
    found = run(double_integrator(1), law, [0.0], duration=5.0, dt=1e-3, position=[0.3])
    k_p, k_i, k_d = 4.0, 1.6, 2.8
    matrix = np.array([[0, 1, 0], [-k_p, -k_d, -1], [k_i, 0, 0]])
    for k in (500, 1500, 4000):
        expected = (expm(matrix * found.time[k]) @ [-0.3, 0.0, 0.0])[0]
        np.testing.assert_allclose(found.signals["error"][k, 0], expected, atol=5e-4)


@pytest.mark.full
def test_integral_is_the_estimate_of_a_constant_load():
    law = pid(double_integrator(2).model(), frequency=3.0)
    found = run(double_integrator(2), law, [0.0, 0.0], sinusoid(0.0, 1.0, offset=[1.5, -0.5]), duration=60.0)
    np.testing.assert_allclose(found.signals["estimate"][-1], [1.5, -0.5], rtol=1e-6)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-6)


def test_gains_may_be_given():
    model = double_integrator(1).model()
    placed, given = pid(model, frequency=2.0, damping=0.5), pid(model, gains=[4.0, 0.8, 2.0])
    for name in ("proportional", "integral", "derivative"):
        np.testing.assert_allclose(getattr(placed, name), getattr(given, name))


@pytest.mark.full
def test_limits_do_not_wind_up():
    """A step of 5 m and a load of 1 m/s^2 with 1.5 m/s^2 at hand. Negative control: told that all was applied."""
    plant = double_integrator(1, limit=1.5)
    law = pid(plant.model(), sampling_time=1e-2, frequency=2.0, integral_share=0.3, reference_frequency=0.0)
    found = run(plant, law, [5.0], sinusoid(0.0, 1.0, offset=-1.0), duration=60.0)
    overshoot = -float(found.signals["error"].min())
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-4)

    target, dt = Target(jnp.array([5.0]), jnp.zeros(1), jnp.zeros(1)), 1e-2

    def misled(state, _):
        x, v, z = state
        y = Measurement(x, v)
        wanted = law.proportional * (5.0 - x) - law.derivative * v + z.law
        moved = v + dt * (jnp.clip(wanted, -1.5, 1.5) - 1.0)
        return (x + dt * v, moved, law.advance(z, y, target, wanted, dt)), x[0]

    start = (jnp.zeros(1), jnp.zeros(1), law.init(Measurement(jnp.zeros(1), jnp.zeros(1)), target))
    furthest = float(jax.lax.scan(misled, start, None, length=2000)[1].max()) - 5.0
    assert overshoot < 0.5 * furthest, (overshoot, furthest)


@pytest.mark.full
def test_an_integral_faster_than_the_sampling_stays_bounded():
    """At its limit the integral is at most what takes the other terms back: k_p e + k_d e_dot, and the limit itself."""
    plant, dt, frequency, limit = double_integrator(1, limit=1.5), 1e-2, 2617.0, 1.5
    law = pid(plant.model(), sampling_time=dt, frequency=frequency, reference_frequency=0.0)
    found = run(plant, law, [5.0], duration=10.0, dt=dt)
    error, rate = (float(np.abs(one).max()) for one in (found.signals["error"], found.signals["velocity"]))
    k_p, k_d, k_i = frequency**2, 2 * frequency, 0.1 * frequency**3
    assert np.abs(found.signals["estimate"]).max() <= (k_p + dt * k_i) * error + k_d * rate + limit


@pytest.mark.full
def test_steady_curve_holds_a_force_and_limits_of_an_endless_supply_are_endless():
    plant = hybrid_vehicle(bluerov2_heavy(), t200(dead_zone=0.0))
    drive = plant.model().in_body_axes().actuators.quasi_static()
    forces = jnp.linspace(-20.0, 20.0, 8)
    np.testing.assert_allclose(drive.force((), drive.command((), forces, 1.0)), forces, rtol=1e-12)
    endless = hybrid_vehicle(bluerov2_heavy(), t200(supply=np.inf)).model().in_body_axes().actuators.quasi_static()
    low, high = endless.range((), 1.0)
    assert (np.asarray(low) == -np.inf).all() and (np.asarray(high) == np.inf).all()


@pytest.mark.slow
@pytest.mark.parametrize("motor", ["steady", "computed"])
def test_vehicle_comes_to_its_place(motor):
    """Without a dead zone: inside one, a vehicle that needs no thrust wanders about its place."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200(dead_zone=0.0), ledger=False)
    law = pid(plant.model(), sampling_time=0.02, frequency=1.0, motor=motor)
    found = run(plant, law, [1.0, -1.0, 0.5, 0.0, 0.0, 2.0], duration=40.0, dt=0.02)
    assert int(found.status) == 0
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=0.02)


@pytest.mark.full
@pytest.mark.parametrize("feedforward", [True, False])
def test_pendulum_stands(feedforward):
    pendulum = inverted_pendulum()
    found = run(pendulum, pid(pendulum.model(), frequency=8.0, feedforward=feedforward), [0.1], duration=8.0)
    assert int(found.status) == 0 and abs(float(found.signals["error"][-1, 0])) < 5e-3


@pytest.mark.full
def test_ball_floats():
    ball = magnetic_levitation()
    found = run(ball, pid(ball.model(), frequency=30.0), [0.010], duration=5.0, dt=1e-3, position=[0.010])
    assert int(found.status) == 0 and abs(float(found.signals["error"][-1, 0])) < 1e-4


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"frequency": -1.0}, "frequency"),
        ({"damping": 0.1, "integral_share": 0.5}, "integral"),
        ({"gains": [1.0, 3.0, 2.0]}, "gains"),
        ({"gains": [1.0, 2.0]}, "gains"),
        ({"motor": "magic"}, "motor"),
        ({"sampling_time": 0.0}, "sampling_time"),
    ],
)
def test_settings_that_cannot_be(wrong, name):
    with pytest.raises(BadInput, match=f"^`{name}"):
        pid(double_integrator(1).model(), **wrong)
