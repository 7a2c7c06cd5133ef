"""Super-twisting: finite time, the load it finds, accuracy of second order, and a PID inside the layer."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are

from undertow.control.controllers import pid, super_twisting
from undertow.control.controllers.super_twisting import contraction, least_second
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

NO_LAYER = {"layer": 1e-9, "reference_frequency": 0.0}


def run(plant, law, goal, disturbance=None, duration=20.0, dt=1e-2, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)


def reaching_time(found, within=1e-3):
    """Time after which |s| stays below a bound, s."""
    outside = np.flatnonzero(np.abs(found.signals["surface"][:, 0]) > within)
    return float(found.time[outside[-1] + 1])


def longest_time(first, second, bound, s, w):
    """Bound of the reaching time: V = z^T P z with z = (|s|^(1/2) sign s, w) and a Riccati equation for P.

    z_dot = |s|^(-1/2) (A z + b d), |d| <= L |z_1|; then V_dot <= -eps |z|^2 / |z_1| <= -eps V^(1/2) / |P|^(1/2).
    """
    a = np.array([[-first * np.sqrt(bound) / 2, 0.5], [-second * bound, 0.0]])
    b, c = np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    best = np.inf
    for eps in np.geomspace(1e-3, 0.3, 60):
        try:
            p = solve_continuous_are(a, b, bound**2 * c.T @ c + eps * np.eye(2), -np.eye(1))
        except np.linalg.LinAlgError:
            continue
        if np.linalg.eigvalsh(p).min() > 0:
            z = np.array([np.sqrt(abs(s)) * np.sign(s), w])
            best = min(best, 2 * np.sqrt(z @ p @ z * np.linalg.eigvalsh(p).max()) / eps)
    return best


@pytest.mark.full
def test_reaches_the_surface_in_the_time_of_the_lyapunov_function_and_finds_the_load():
    """A load of rate 0.9 L; afterwards w is the load and the error decays at the slope of the surface."""
    first, second, bound = 2.0, 1.5, 1.0
    plant = double_integrator(1)
    law = super_twisting(plant.model(), slope=1.0, rate_bound=bound, first=first, second=second, **NO_LAYER)
    found = run(plant, law, [0.0], sinusoid(0.9, 1.0), duration=20.0, dt=1e-3, position=[-0.5])
    limit = longest_time(first, second, bound, s=0.5, w=0.0)
    reached = reaching_time(found)
    assert 0.5 < reached < limit < 20.0, (reached, limit)
    after = found.time > reached + 0.5
    np.testing.assert_allclose(found.signals["estimate"][after, 0], 0.9 * np.sin(found.time[after]), atol=5e-3)
    k = int(np.argmax(found.time > reached + 0.5))
    decay = found.signals["error"][k + 1000, 0] / found.signals["error"][k, 0]
    np.testing.assert_allclose(decay, np.exp(-1.0), rtol=5e-3)


@pytest.mark.full
def test_time_grows_with_the_root_of_the_distance():
    """The homogeneity of degree -1 without a load: four times as far takes twice as long."""
    plant = double_integrator(1)
    law = super_twisting(plant.model(), slope=1.0, rate_bound=1.0, **NO_LAYER)
    near, far = (
        reaching_time(run(plant, law, [0.0], duration=10.0, dt=1e-3, position=[-x]), within=2e-3 * x)
        for x in (0.5, 2.0)
    )
    np.testing.assert_allclose(far, 2 * near, rtol=0.01)


@pytest.mark.full
def test_sampled_surface_has_the_accuracy_of_second_order():
    """|s| is of the order of L T^2 (Levant 1993), where a first-order sliding mode has T."""
    plant, sizes = double_integrator(1), []
    for dt in (4e-3, 2e-3):
        law = super_twisting(plant.model(), slope=1.0, rate_bound=1.0, **NO_LAYER)
        found = run(plant, law, [0.0], sinusoid(0.9, 1.0), duration=15.0, dt=dt)
        sizes.append(np.abs(found.signals["surface"][found.time > 8.0]).max() / dt**2)
    assert max(sizes) < 10.0
    np.testing.assert_allclose(sizes[0], sizes[1], rtol=0.3)


@pytest.mark.full
def test_inside_the_layer_it_is_a_pid():
    plant, slope, bound, layer = double_integrator(1), 1.5, 2.0, 0.4
    law = super_twisting(plant.model(), slope=slope, rate_bound=bound, layer=layer, reference_frequency=0.0)
    steep, second = 2.0 * np.sqrt(bound / layer), 1.1 * bound / layer
    same = pid(plant.model(), gains=[slope * steep + second, slope * second, slope + steep], reference_frequency=0.0)
    # The integral of s is that of e times the slope, and e itself: the same from an error of zero.
    ours, theirs = (
        run(plant, one, [0.0], sinusoid(0.3, 1.0, offset=0.2), duration=10.0, dt=1e-3) for one in (law, same)
    )
    assert np.abs(ours.signals["surface"]).max() < layer
    np.testing.assert_allclose(ours.signals["error"], theirs.signals["error"], atol=2e-4)
    np.testing.assert_allclose(ours.signals["input"], theirs.signals["input"], atol=2e-3)


def crossing_under_the_worst_load(first, second):
    """|w - load| at the next crossing, from 1 at the last one, in the coordinates |s|^(1/2) and w - load."""

    def until(rate, start, event):
        event.terminal, event.direction = True, -1
        slope = lambda _, y: [y[1] - first * y[0], -2 * rate * y[0]]
        return solve_ivp(slope, (0, 1e4), start, events=event, rtol=1e-10, atol=1e-12).y[:, -1]

    turn = until(second - 1, [1e-12, 1.0], lambda _, y: y[1] - first * y[0])
    return -until(second + 1, [turn[0], turn[1] * (1 - 1e-10)], lambda _, y: y[0])[1]


@pytest.mark.parametrize(("first", "second"), [(1.0, 1.1), (1.5, 1.1), (2.0, 1.1), (1.0, 2.2), (1.5, 1.3), (0.5, 2.0)])
def test_contraction_is_that_of_the_worst_load(first, second):
    expected = crossing_under_the_worst_load(first, second)
    np.testing.assert_allclose(contraction(np.array(first), np.array(second)), expected, rtol=1e-5)
    np.testing.assert_allclose(jax.jit(contraction)(first, second), expected, rtol=1e-5)


@pytest.mark.parametrize("first", [0.5, 0.9, 1.5, 3.0])
def test_least_second_gain_is_where_nothing_contracts(first):
    """Large first gains reject every load that the second one exceeds."""
    least = least_second(np.array(first))
    assert (contraction(np.array(first), least * (1 + 1e-6)) < 1).all()
    if first < 1.0:
        np.testing.assert_allclose(contraction(np.array(first), least), 1.0, rtol=1e-6)
    else:
        np.testing.assert_allclose(least, 1.0, rtol=1e-6)


@pytest.mark.full
def test_limits_do_not_wind_up():
    plant = double_integrator(1, limit=1.5)
    law = super_twisting(plant.model(), sampling_time=1e-2, slope=1.0, rate_bound=0.5, reference_frequency=0.0)
    found = run(plant, law, [5.0], sinusoid(0.0, 1.0, offset=-1.0), duration=60.0)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-4)
    assert np.abs(found.signals["estimate"]).max() < 6.0


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"slope": -1.0}, "slope"),
        ({"rate_bound": 0.0}, "rate_bound"),
        ({"layer": 0.0}, "layer"),
        ({"second": 0.9}, "second"),
        ({"first": 0.9, "second": 1.1}, "second"),
        ({"motor": "magic"}, "motor"),
    ],
)
def test_settings_that_cannot_be(wrong, name):
    with pytest.raises(BadInput, match=f"^`{name}"):
        super_twisting(double_integrator(1).model(), **wrong)
