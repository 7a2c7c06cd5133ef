"""Suite U2, for long runs: U1 of t mod 20 s."""

import equinox as eqx
import jax
import numpy as np
import pytest

from undertow.physics.disturbances import u1, u2
from undertow.physics.plants.double_integrator import double_integrator
from undertow.studies.speed.plain_numpy import suite_u1

PLANT = double_integrator(6)


def signals(load, times):
    return np.asarray(_signals(load, np.asarray(times)))


@eqx.filter_jit
def _signals(load, times):
    return jax.vmap(lambda t: load.at((), t, None, PLANT.no_load()).acceleration)(times)


def test_u2_is_u1_of_the_time_in_its_period():
    within = np.arange(0.05, 20.0, 0.1)
    expected = np.array([suite_u1(t) for t in within])
    for turns in (0, 1, 7, 99):
        np.testing.assert_allclose(signals(u2(), within + 20 * turns), expected, rtol=0, atol=1e-8)
    assert np.abs(signals(u1(), within + 20) - expected).max() > 1, "U1 itself goes on and sweeps up"
    np.testing.assert_allclose(signals(u2(0.5), within), expected / 2, atol=1e-8)


@pytest.mark.full
def test_the_chirp_of_u2_never_passes_10_rad_per_s():
    """Zero crossings of d6 = 2 sin(t^2 / 4): 31 in 20 s, period after period; those of U1 grow in number."""
    crossings = lambda load, start: (
        np.diff(np.sign(signals(load, start + np.arange(0.01, 20, 0.01))[:, 5])) != 0
    ).sum()
    assert [crossings(u2(), 20 * turns) for turns in (0, 5, 50)] == [31, 31, 31]
    assert crossings(u1(), 100) > 300


@pytest.mark.parametrize("duration", [45.0, *(pytest.param(t, marks=pytest.mark.full) for t in (7.0, 20.0))])
def test_jumps_are_where_the_signal_jumps(duration):
    grid = np.arange(0.0, duration, 0.5)[1:]
    step = np.abs(signals(u2(), grid + 1e-6) - signals(u2(), grid - 1e-6)).max(1)
    assert list(u2().jumps(duration)) == list(grid[step > 1e-2])
