"""MRAC: the reference model without error, the Lyapunov function, what is learnt, limits, and a PID as its limit."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import mrac, pid
from undertow.control.navigation import perfect
from undertow.control.references import setpoint, sine
from undertow.core.contracts import Measurement
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop


def run(plant, law, reference, disturbance=None, duration=20.0, dt=1e-2, **start):
    loop = ClosedLoop(plant, law, reference, disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)


@pytest.mark.full
def test_nominal_plant_is_the_reference_model():
    """Without a load nothing is learnt, and the error is that of a critically damped loop."""
    plant, w = double_integrator(1), 2.0
    law = mrac(plant.model(), frequency=w, adaptation=5.0, reference_frequency=0.0)
    found = run(plant, law, setpoint([0.0]), duration=6.0, dt=1e-3, position=[-1.0])
    expected = (1 + w * found.time) * np.exp(-w * found.time)
    np.testing.assert_allclose(found.signals["error"][:, 0], expected, atol=2e-3)
    assert np.abs(found.signals["model_error"]).max() < 1e-9
    assert np.abs(found.signals["estimate"]).max() < 1e-8


@pytest.mark.full
def test_lyapunov_function_falls_and_the_parameters_are_found():
    """v_dot = L a + t_1 + t_2 v + t_3 |v| v with L = 0.8: V = 1/2 E^T P E + L |theta - theta*|^2 / (2 gamma).

    It falls by the integral of 1/2 E^T Q E, and a reference of two frequencies excites all four parameters.
    """
    w, gamma, scale, share, dt = 2.0, 4.0, 2.0, 0.8, 1e-3
    truth = jnp.array([0.5, -0.4, -0.3])
    model = double_integrator(1).model()
    law = mrac(model, frequency=w, adaptation=gamma, scale=scale, bound=5.0, reference_frequency=0.0)
    ideal = jnp.array([*(truth / share), scale * (share - 1) / share])
    c = w / 2
    p = jnp.array([[w**2 + 2 * w * c, c], [c, 1.0]])
    q = jnp.diag(jnp.array([2 * w**2 * c, 4 * w - 2 * c]))
    one, other = sine([1.0], [1.0]), sine([0.4], [2.7])

    def step(state, k):
        x, v, z = state
        r = jax.tree.map(jnp.add, one.at(k * dt), other.at(k * dt))
        y = Measurement(x, v)
        u, _ = law.command(z, y, r)
        off = jnp.stack([r.position - x - z.law.error, r.velocity - v - z.law.rate])[:, 0]
        away = z.law.parameters[0] - ideal
        value = off @ p @ off / 2 + share * (away**2).sum() / (2 * gamma)
        flow = lambda v: share * u + truth[0] + truth[1] * v + truth[2] * jnp.abs(v) * v
        middle = v + dt / 2 * flow(v)
        return (x + dt * middle, v + dt * flow(middle), law.advance(z, y, r, u, dt)), (value, off @ q @ off / 2, away)

    y, r = Measurement(jnp.zeros(1), jnp.zeros(1)), jax.tree.map(jnp.add, one.at(0.0), other.at(0.0))
    started = law.advance(law.init(y, r), y, r, law.command(law.init(y, r), y, r)[0], 1e-12)
    _, (value, lost, away) = jax.lax.scan(step, (jnp.zeros(1), jnp.zeros(1), started), jnp.arange(200_000.0))
    value, lost = np.asarray(value), np.asarray(lost)
    assert np.diff(value).max() < 1e-3 * value[0]
    np.testing.assert_allclose(value[0] - value[20_000], dt * lost[:20_000].sum(), rtol=0.03)
    assert np.abs(away[0]).max() > 0.6
    np.testing.assert_allclose(away[-1], 0.0, atol=0.02)


@pytest.mark.full
def test_with_the_load_alone_it_is_a_pid():
    """The velocity and the nominal acceleration stay small, so that their parameters do nothing."""
    plant, w, gamma, small = double_integrator(1), 2.0, 1.5, 1e-4
    law = mrac(plant.model(), frequency=w, adaptation=gamma, reference_frequency=0.0)
    gains = [w**2 + gamma, gamma * w / 2, 2 * w]
    same = pid(plant.model(), gains=gains, reference_frequency=0.0)
    load = sinusoid(small, 1.0, offset=small)
    ours, theirs = (run(plant, one, setpoint([0.0]), load, duration=10.0, dt=1e-3) for one in (law, same))
    size = np.abs(theirs.signals["error"]).max()
    np.testing.assert_allclose(ours.signals["error"] / size, theirs.signals["error"] / size, atol=5e-3)


@pytest.mark.full
def test_limits_teach_nothing():
    """A step far beyond the limit: the reference model is moved by what is missing, and E stays zero."""
    plant = double_integrator(1, limit=1.0)
    law = mrac(plant.model(), sampling_time=1e-2, frequency=2.0, adaptation=5.0, reference_frequency=0.0)
    found = run(plant, law, setpoint([10.0]), duration=30.0)
    assert np.abs(found.signals["attained_share"]).min() < 0.5
    assert np.abs(found.signals["estimate"]).max() < 1e-8
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-6)


@pytest.mark.full
def test_e_modification_forgets_and_projection_bounds():
    plant = double_integrator(1)
    options = {"frequency": 2.0, "adaptation": 4.0, "reference_frequency": 0.0}
    load = sinusoid(3.0, 2.0, offset=2.0)
    plain, leaky, bounded = (
        run(plant, mrac(plant.model(), **options, **more), setpoint([0.0]), load, duration=40.0)
        for more in ({}, {"e_modification": 1.0}, {"bound": 0.5})
    )
    size = [float(np.abs(one.signals["estimate"][2000:]).max()) for one in (plain, leaky)]
    assert size[1] < 0.8 * size[0]
    # Four parameters of at most 0.5, of which the load's is the whole where nothing moves.
    assert np.abs(bounded.signals["estimate"]).max() < 0.9 * size[0]


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"frequency": -1.0}, "frequency"),
        ({"damping": 0.2}, "damping"),
        ({"damping": 0.4, "filter_ratio": 1.0}, "damping"),
        ({"adaptation": -1.0}, "adaptation"),
        ({"e_modification": -1.0}, "e_modification"),
        ({"bound": 0.0}, "bound"),
    ],
)
def test_settings_that_cannot_be(wrong, name):
    with pytest.raises(BadInput, match=f"^`{name}"):
        mrac(double_integrator(1).model(), **wrong)
