"""Integral sliding mode: the nominal response under any load below the amplitude, and a surface in closed form."""

import numpy as np
import pytest

from undertow.control.controllers import integral_sliding_mode, pid
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop


def run(plant, law, goal, disturbance=None, duration=20.0, dt=1e-2, **start):
    loop = ClosedLoop(plant, law, setpoint(goal), disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)


@pytest.mark.full
def test_nominal_response_from_the_first_instant_under_a_load():
    """|s| <= phi, and |e - e_nominal| <= phi times the integral of |g| = 2 / (w exp(1)), g of p / (p + w)^2."""
    plant, w, phi, start = double_integrator(1), 2.0, 0.02, -1.0
    law = integral_sliding_mode(plant.model(), frequency=w, amplitude=2.0, layer=phi, reference_frequency=0.0)
    found = run(plant, law, [0.0], sinusoid(1.0, 3.0, offset=0.9), duration=8.0, dt=1e-3, position=[start])
    t = found.time
    nominal = -start * (1 + w * t) * np.exp(-w * t)
    assert np.abs(found.signals["surface"]).max() <= phi
    apart = np.abs(found.signals["error"][:, 0] - nominal).max()
    assert apart <= 2 * phi / (w * np.e) + 2e-3
    # Negative control: the same nominal loop with an ordinary integral.
    slow = run(plant, pid(plant.model(), frequency=w, reference_frequency=0.0), [0.0], sinusoid(1.0, 3.0, offset=0.9),
               duration=8.0, dt=1e-3, position=[start])  # fmt: skip
    assert np.abs(slow.signals["error"][:, 0] - nominal).max() > 5 * apart


@pytest.mark.full
@pytest.mark.parametrize("limit", [np.inf, 1.5])
def test_surface_under_a_constant_load_has_a_closed_form(limit):
    """s = -(d / c) (1 - exp(-c t)), c = M / phi, also while the input is at its limit: no windup."""
    plant = double_integrator(1, limit=limit)
    law = integral_sliding_mode(
        plant.model(), sampling_time=1e-3, frequency=1.0, amplitude=3.0, layer=2.0, reference_frequency=0.0
    )
    load, c = -1.0, 1.5
    found = run(plant, law, [5.0], sinusoid(0.0, 1.0, offset=load), duration=40.0, dt=1e-3)
    expected = -(load / c) * (1 - np.exp(-c * found.time))
    np.testing.assert_allclose(found.signals["surface"][:, 0], expected, atol=2e-3)
    np.testing.assert_allclose(found.signals["estimate"][-1, 0], load, rtol=1e-6)
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-6)


@pytest.mark.full
def test_inside_the_layer_it_is_a_pid():
    """(p + c) (p^2 + 2 zeta w p + w^2), from an error of zero."""
    plant, w, zeta, c = double_integrator(1), 2.0, 0.8, 0.5
    law = integral_sliding_mode(
        plant.model(), frequency=w, damping=zeta, amplitude=1.0, layer=2.0, reference_frequency=0.0
    )
    gains = [w**2 + 2 * zeta * w * c, c * w**2, 2 * zeta * w + c]
    same = pid(plant.model(), gains=gains, reference_frequency=0.0)
    ours, theirs = (run(plant, one, [0.0], sinusoid(0.3, 1.0), duration=10.0, dt=1e-3) for one in (law, same))
    np.testing.assert_allclose(ours.signals["error"], theirs.signals["error"], atol=1e-4)


@pytest.mark.full
def test_a_load_above_the_amplitude_leaves_the_layer():
    """Negative control: then s grows at the rate of the excess."""
    plant = double_integrator(1)
    law = integral_sliding_mode(plant.model(), frequency=2.0, amplitude=1.0, layer=0.1, reference_frequency=0.0)
    found = run(plant, law, [0.0], sinusoid(0.0, 1.0, offset=1.5), duration=6.0, dt=1e-3)
    growth = np.diff(found.signals["surface"][[3000, 5000], 0])[0] / 2.0
    np.testing.assert_allclose(growth, -0.5, rtol=1e-6)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"frequency": -1.0}, "frequency"),
        ({"damping": 0.0}, "damping"),
        ({"amplitude": [1.0, 2.0]}, "amplitude"),
        ({"layer": 0.0}, "layer"),
    ],
)
def test_settings_that_cannot_be(wrong, name):
    with pytest.raises(BadInput, match=f"^`{name}"):
        integral_sliding_mode(double_integrator(1).model(), **wrong)
