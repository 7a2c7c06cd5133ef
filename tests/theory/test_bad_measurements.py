"""Section 3.7: how late a measurement may come, and what one bad sample does."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.analysis import small_signal
from undertow.control.controllers.rcaf import rcaf
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractNavigation, Measurement
from undertow.physics.disturbances.none import none
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

DT = 2.5e-4  # s
MARGINS = {
    "rcafc": ({}, 4.75e-3),
    "rafc": ({"composite": 0.0}, 14.75e-3),
    "no robust term": ({"robust_gain": 0.0}, 7.5e-3),
}


def delay_margin(law):
    """Least delay, s, of the measured position and velocity that brings a pole of the law to the imaginary axis.

    With the loop cut at the measurement, u = -C(p) x and x = u / p^2: C / p^2 = -exp(p delay).
    """
    g = small_signal.gains(law)
    frequency = np.geomspace(1e-2, 1e4, 400_001)
    p = 1j * frequency
    # eps = x_hat_dot - v and z of the law, driven by x and u.
    z_of_eps, z_of_x = -g.b2 / p, g.adaptation * (g.p12 + g.p22 * p) / p  # s = -(p12 + p22 p) x
    # p (eps + p x) = -a1 eps + u + z, u = -(stiffness + damping p) x - z: the estimate cancels.
    eps = (-(g.stiffness + g.damping * p) - p**2) / (p + g.pole)
    z = z_of_eps * eps + z_of_x
    loop = (g.stiffness + g.damping * p + z) / p**2
    size = np.abs(loop)
    at = np.flatnonzero((size[:-1] - 1) * (size[1:] - 1) < 0)
    lag = np.angle(-loop[at]) % (2 * np.pi)  # C / p^2 = -exp(i lag): what a delay has to turn back
    return float((lag / frequency[at]).min())


class Late(AbstractNavigation):
    """Everything as it was a number of steps ago."""

    steps: jax.Array
    longest: int = eqx.field(static=True, default=80)
    smooth: bool = eqx.field(static=True, default=False)

    def realize(self, key) -> tuple[()]:
        return ()

    def init(self, path, truth) -> Any:
        now = jnp.stack([truth.position, truth.velocity])
        return jnp.broadcast_to(now, (self.longest, *now.shape))

    def measure(self, path, state, t, truth):
        now = jnp.stack([truth.position, truth.velocity])
        return Measurement(*state[self.longest - self.steps]), jnp.concatenate([state[1:], now[None]])


@pytest.mark.parametrize("name", MARGINS)
def test_delay_margin(name):
    choices, printed = MARGINS[name]
    plant = double_integrator()
    law = rcaf(plant.model(), **({"preset": "paper", "sets": 3} | choices))
    margin = delay_margin(law)
    print(f"{name}: {1e3 * margin:.3f} ms, printed {1e3 * printed}")
    whole_ticks = np.floor((margin - DT / 2) / DT)  # an input that is held is itself half a step late
    assert whole_ticks * DT == pytest.approx(printed)
    for factor, stable in ((0.9, True), (1.1, False)):
        steps = round(factor * margin / DT - 0.5)
        loop = ClosedLoop(plant, law, setpoint([1e-6]), none(), Late(jnp.asarray(steps)))
        rate = np.abs(np.asarray(sampled.simulate(loop, duration=4.0, dt=DT, record_every=1).signals["velocity"]))[:, 0]
        assert (rate[-1000:].max() < 0.1 * rate[:1000].max()) == stable, (factor, steps)


class OneBad(AbstractNavigation):
    """The truth, but for one sample of the velocity."""

    error: float
    smooth: bool = eqx.field(static=True, default=False)

    def realize(self, key) -> tuple[()]:
        return ()

    def init(self, path, truth) -> tuple[()]:
        return ()

    def measure(self, path, state, t, truth):
        bad = jnp.where(jnp.round(t / 1e-3) == 100, self.error, 0.0)
        return truth._replace(velocity=truth.velocity + bad), ()


@pytest.mark.parametrize(("error", "spacing", "printed"), [(1.0, 1.0, 13.4), (5.0, 1.0, 28.0), (5.0, 0.1, 108.0)])
def test_one_bad_sample(error, spacing, printed):
    """1 kHz; a box of 20 around the weights keeps the estimate within 20, however bad the sample."""
    plant = double_integrator()
    peaks = []
    for bound in (np.inf, 20.0):
        law = rcaf(plant.model(), preset="paper", sets=3, reach=(spacing,), weights_bound=bound)
        loop = ClosedLoop(plant, law, setpoint([0.0]), none(), OneBad(error))
        samples = sampled.simulate(loop, duration=0.5, dt=1e-3, record_every=1).signals
        peaks.append(float(jnp.abs(samples["estimate"]).max()))
    print(f"{error} m/s, sets {spacing}: {peaks}, printed {printed}")
    assert peaks[0] == pytest.approx(printed, rel=0.1)
    assert peaks[1] <= min(peaks[0], 20.0) * (1 + 1e-12)
