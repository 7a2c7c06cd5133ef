"""I13: RAFC, written out by itself from Eq. (61), and RCAFC with gamma_eps = 0 give the same bits."""

import jax
import numpy as np
import pytest

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.white_noise import white_noise
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import AbstractContinuousController, Model
from undertow.core.numerics.linear_algebra import matvec
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full


class PlainRAFC(AbstractContinuousController):
    """theta_dot = -gamma s xi(eps), Eq. (61); everything else as in the composite law."""

    law: AbstractContinuousController
    model: Model
    method: str = "euler"
    substeps: int = 1

    def init(self, y, r):
        return self.law.init(y, r)

    def command(self, z, y, r):
        return self.law.command(z, y, r)

    def signals(self):
        return self.law.signals()

    def flow(self, z, y, r, u_applied):
        law = self.law
        p = law.lyapunov()
        error, error_rate = self.model.coordinates.difference(r.position, y.position), r.velocity - y.velocity
        s = p[..., 0, 1] * error + p[..., 1, 1] * error_rate
        eps = law.identification.error(z.predicted_velocity, y.velocity)
        xi = law.fuzzy.basis(eps[:, None])
        known = self.model.dynamics.drift(y) + matvec(self.model.dynamics.gain(y), u_applied)
        return type(z)(
            predicted_position=z.predicted_velocity,
            predicted_velocity=law.identification.acceleration(eps, known, law.fuzzy.output(z.weights, xi)),
            weights=-(law.adaptation * s)[:, None] * xi,
        )

    def project(self, z):
        return z


def trajectory(make, key):
    plant = double_integrator(3)
    load = sinusoid(np.array([1.0, 5.0, 0.1]), np.array([1.0, 20.0, 3.0]), offset=0.3)
    loop = ClosedLoop(plant, make(plant.model()), setpoint(np.array([2.0, 0.0, -1.0])), load, white_noise())
    outcome = sampled.simulate(loop, duration=2.0, key=key)
    return outcome.signals, outcome.final


def rafc(model):
    return PlainRAFC(rcaf(model, preset="paper", composite=0.0), model)


def test_same_bits(key):
    plain, special = trajectory(rafc, key), trajectory(lambda model: rcaf(model, preset="paper", composite=0.0), key)
    for one, other in zip(jax.tree.leaves(plain), jax.tree.leaves(special), strict=True):
        np.testing.assert_array_equal(np.asarray(one), np.asarray(other))


def test_composite_term_is_not_nothing(key):
    """Negative control."""
    plain, composite = trajectory(rafc, key), trajectory(lambda model: rcaf(model, preset="paper", composite=1e-3), key)
    pairs = zip(jax.tree.leaves(plain), jax.tree.leaves(composite), strict=True)
    assert any((np.asarray(one) != np.asarray(other)).any() for one, other in pairs)


def test_one_axis_may_be_rafc_beside_others(key):
    """Gains per axis: the axis with gamma_eps = 0 is the RAFC one, bit for bit; the others are not."""
    mixed = trajectory(lambda model: rcaf(model, preset="paper", composite=np.array([0.0, 500.0, 500.0])), key)
    plain = trajectory(rafc, key)
    mixed, plain = (signals["position"] for (signals, _) in (mixed, plain))
    np.testing.assert_array_equal(np.asarray(mixed)[:, 0], np.asarray(plain)[:, 0])
    assert (np.asarray(mixed)[-1, 1:] != np.asarray(plain)[-1, 1:]).all()
