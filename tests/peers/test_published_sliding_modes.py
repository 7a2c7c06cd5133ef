"""super_twisting and integral_sliding_mode: times and trajectories that follow from the equations of their sources."""

import numpy as np
import pytest

from undertow.control.controllers import integral_sliding_mode, super_twisting
from undertow.control.controllers.super_twisting import contraction
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

# k_1 = 1.5 L^(1/2), k_2 = 1.1 L: Levant's, and the usual ones since
FIRST, SECOND = 1.5, 1.1


def run(law, load, duration, dt, **start):
    loop = ClosedLoop(double_integrator(1), law, setpoint([0.0]), load, perfect())
    found = sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)
    return np.asarray(found.time), {name: np.ravel(value) for name, value in found.signals.items()}


def twisting(bound, dt):
    return super_twisting(
        double_integrator(1).model(),
        sampling_time=dt,
        slope=1.0,
        rate_bound=bound,
        first=FIRST,
        second=SECOND,
        layer=1e-9,
        reference_frequency=0.0,
    )


@pytest.mark.parametrize("bound", [1.0, 4.0])
def test_super_twisting_reaches_the_surface_in_the_time_of_its_half_turns(bound):
    """A constant load d met on the surface: turns are shorter by rho = exp(-pi k_1 / (8 k_2 - k_1^2)^(1/2)) each.

    w moves at +-k_2, so that a turn from |w - d| takes (1 + rho) |w - d| / k_2; in all (1 + rho) / (1 - rho) d / k_2.
    """
    load, dt = 2.0, 2e-4
    found = run(twisting(bound, dt), sinusoid(0.0, 1.0, offset=load), 8.0 / bound, dt)
    time, surface, estimate = found[0], found[1]["surface"], found[1]["estimate"]
    rho = np.exp(-np.pi * FIRST / np.sqrt(8 * SECOND - FIRST**2))
    expected = (1 + rho) / (1 - rho) * load / (SECOND * bound)
    late = np.flatnonzero(np.abs(estimate - load) > 2e-3 * load)[-1]
    np.testing.assert_allclose(time[late], expected, rtol=0.01)
    crossings = np.flatnonzero(np.diff(np.sign(surface[1:])))[:2] + 1
    turns = np.abs(estimate - load)[crossings]
    np.testing.assert_allclose([turns[0] / load, turns[1] / turns[0]], rho, rtol=0.02)


def test_super_twisting_contracts_by_the_ratio_of_the_worst_load_at_most():
    """Loads that change at the rate L, whatever their phase, reach less at the next crossing than the worst one."""
    most, dt = float(contraction(np.array(FIRST), np.array(SECOND))), 5e-4
    for phase in np.linspace(0, 2 * np.pi, 5):
        load = sinusoid(2.0, 0.5, phase=phase)  # rate 1 = L at most
        time, found = run(twisting(1.0, dt), load, 8.0, dt)
        off = np.abs(found["estimate"] - 2.0 * np.sin(0.5 * time + phase))
        crossings = np.flatnonzero(np.diff(np.sign(found["surface"][1:]))) + 1
        ratios = off[crossings[1:4]] / off[crossings[:3]]
        assert (ratios[off[crossings[1:4]] > 0.02] < most).all()


def test_integral_sliding_mode_is_on_the_nominal_trajectory_from_the_start():
    """Utkin and Shi (1996): no reaching phase, whatever load below M; without a load exactly, to the sampling time."""
    w, dt, start = 1.0, 1e-3, 1.0
    law = integral_sliding_mode(
        double_integrator(1).model(),
        sampling_time=dt,
        frequency=w,
        damping=1.0,
        amplitude=2.0,
        layer=0.02,
        reference_frequency=0.0,
    )
    for load, within in ((none(), 1e-3), (sinusoid(1.5, 2.0), 0.012)):
        time, found = run(law, load, 10.0, dt, position=[start])
        nominal = start * (1 + w * time) * np.exp(-w * time)
        assert np.abs(found["position"] - nominal).max() < within * start
        assert np.abs(found["surface"]).max() < 0.02
