"""The neural-network law: a limit case that is a PID, what the network takes off the error, bounded weights."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import neural, pid
from undertow.control.navigation import perfect
from undertow.control.references import setpoint, sine
from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, two_link_arm
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

DT = 1e-2


def run(plant, law, goal, disturbance=None, duration=4.0, simulate=simd_batch.simulate, **start):
    goal = setpoint(goal) if isinstance(goal, list) else goal
    loop = ClosedLoop(plant, law, goal, disturbance or none(), perfect())
    return simulate(loop, duration=duration, dt=DT, record_every=1, **start)


@pytest.mark.full
def test_with_hidden_weights_of_zero_it_is_a_pid():
    """sigma = 1/2 then, so that the output layer is an integral of r with gain I = F (hidden / 4 + 1):
    k_p = K_v Lambda + I, k_d = K_v + Lambda, k_i = I Lambda, from a start without error."""
    plant, load = double_integrator(2), sinusoid(2.0, 3.0, offset=[1.0, -0.5])
    gains = {"slope": 2.0, "gain": 3.0, "adaptation": 0.5}
    off = {"hidden_adaptation": 0.0, "e_modification": 0.0, "robust_gain": 0.0}
    law = neural(plant.model(), sampling_time=DT, hidden=6, **gains, **off)
    law = eqx.tree_at(lambda law: law.start, law, jnp.zeros_like(law.start))
    integral = 0.5 * (6 / 4 + 1)
    like = pid(plant.model(), sampling_time=DT, gains=(6.0 + integral, integral * 2.0, 5.0))
    found, expected = (run(plant, one, [0.0, 0.0], load).signals["error"] for one in (law, like))
    size = float(np.abs(expected).max())
    np.testing.assert_allclose(found, expected, atol=0.02 * size)  # the integral of e_dot by Euler's method is not e
    assert size > 0.1


@pytest.mark.full
def test_at_the_start_it_is_the_outer_loop_alone():
    """W = 0: a = a_d + (K_v + K_z (|V| + Z_M)) r + Lambda e_dot."""
    model = double_integrator(2).model()
    law = neural(model, sampling_time=DT, slope=2.0, gain=3.0, robust_gain=0.1, reference_frequency=0.0)
    y = Measurement(jnp.array([0.1, -0.2]), jnp.array([0.3, 0.1]))
    goal = Target(jnp.array([1.0, 0.5]), jnp.zeros(2), jnp.array([0.2, 0.0]))
    u, _ = law.command(law.init(y, goal), y, goal)
    error, rate = np.array([0.9, 0.7]), np.array([-0.3, -0.1])
    gain = 3.0 + 0.1 * (float(jnp.linalg.norm(law.start)) + 10.0)
    np.testing.assert_allclose(u, np.array([0.2, 0.0]) + gain * (rate + 2 * error) + 2 * rate, rtol=1e-12)


@pytest.mark.full
def test_the_network_learns_gravity_and_coriolis_forces_of_an_arm():
    """As in the source's example: both links of an arm follow sines of period 2 pi; the law has no model of weight and
    Coriolis forces. Its gains are K_v = 20, Lambda = 5 and kappa = 0.1, ten neurons, as there."""
    plant, reference = two_link_arm(), sine(amplitude=[0.5, 0.5], frequency=1.0)
    same = {"slope": 5.0, "gain": 20.0, "hidden": 10, "feedforward": False, "reference_frequency": 0.0}
    same |= {"sampling_time": DT, "robust_gain": 0.0}
    late = []
    for gain in (0.0, 50.0):
        law = neural(plant.model(), adaptation=gain, hidden_adaptation=10.0 if gain else 0.0, **same)
        found = run(plant, law, reference, duration=40.0)
        late.append(float(np.sqrt((found.signals["error"][found.time > 30.0] ** 2).mean())))
    alone, with_network = late
    assert with_network < 0.03 * alone, late
    assert found.signals["weights_size"].max() < 100.0


@pytest.mark.full
def test_e_modification_bounds_the_weights_against_a_load_that_nothing_can_remove():
    """Under a fast load the filtered error persists; the decay kappa F |r| keeps W from growing on."""
    plant, load = double_integrator(1), sinusoid(5.0, 30.0, offset=20.0)
    sizes = []
    for kappa in (0.0, 5.0):
        law = neural(plant.model(), sampling_time=DT, slope=2.0, gain=3.0, adaptation=1.0, e_modification=kappa)
        sizes.append(float(run(plant, law, [0.0], load, duration=60.0).signals["weights_size"].max()))
    assert sizes[1] < 0.5 * sizes[0]


@pytest.mark.full
def test_nothing_is_learnt_while_limits_bind():
    plant = double_integrator(1, limit=0.5)
    law = neural(plant.model(), sampling_time=DT, slope=2.0, gain=3.0, reference_frequency=0.0)
    found = run(plant, law, [50.0], duration=3.0, simulate=sampled.simulate)
    assert found.signals["attained_share"][:-1].max() < 0.5
    np.testing.assert_allclose(found.signals["estimate"], 0.0, atol=1e-15)


def test_a_seed_determines_the_hidden_weights():
    model = double_integrator(2).model()
    one, same, other = (neural(model, sampling_time=DT, seed=seed).start for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert (np.asarray(one) != np.asarray(other)).all()


@pytest.mark.parametrize(("key", "value"), [("hidden", 0), ("slope", 0.0), ("e_modification", -1.0)])
def test_options_that_no_network_can_have(key, value):
    with pytest.raises(BadInput, match=key):
        neural(double_integrator(6).model(), **{key: value})
