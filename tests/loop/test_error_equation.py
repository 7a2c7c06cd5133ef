"""I14: for ideal actuators e_ddot = -K^T E + d_hat - d - u_r (+ sigma), Eqs. (26), (28), at random states.

e_ddot is differentiated from the output along the motion, and d is the load that was prescribed: neither comes from
the loop's own measurement of d, which is checked on the way.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.circle import circle
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

STATES = 32
THRUSTERS = {"all eight": range(1, 9), "five, rank below six": (1, 2, 3, 5, 6)}


def terms(realization, t, position, velocity, estimates):
    """Both sides of the error equation, sigma, and d as measured and as prescribed."""
    loop = realization.loop
    model, law = loop.controller.model, loop.controller
    x, z = realization.start(position, velocity)
    z = z._replace(weights=jnp.broadcast_to(estimates[:, None], z.weights.shape))
    seen = realization.decide(t, x, z)
    moved = loop.plant.dynamics(t, x, seen.applied, realization.load(t, x))
    _, acceleration = jax.jvp(lambda x: loop.plant.output(t, x).velocity, (x,), (moved,))
    sample = realization.signals(t, x, z, seen)
    left = seen.r.acceleration - acceleration
    feedback = law.feedback[0] * sample["error"] + law.feedback[1] * (seen.r.velocity - sample["velocity"])
    wanted = -model.dynamics.drift(seen.y) - sample["estimate"] + feedback + seen.r.acceleration + sample["robust_term"]
    sigma = wanted - model.dynamics.gain(seen.y) @ seen.command
    prescribed = realization.load(t, x).acceleration
    right = -feedback + sample["estimate"] - prescribed - sample["robust_term"]
    return left, right, sigma, sample["uncertainty"], prescribed


@pytest.fixture(scope="module", params=THRUSTERS)
def batch(request):
    plant = HybridVehicle(odin().with_thrusters(tuple(THRUSTERS[request.param])), paper_table3("ideal"))
    load = sinusoid(np.arange(1.0, 7.0), 3.0, offset=-1.0)
    loop = ClosedLoop(plant, rcaf(plant.model(), preset="paper"), circle(depth=1.0), load, perfect())
    realization = loop.realize(jax.random.PRNGKey(0))
    random = np.random.default_rng(14)
    pose = random.uniform(-1, 1, (STATES, 6)) * np.array([4, 4, 4, 3, 1.3, 3])
    arguments = random.uniform(0, 9, STATES), pose, random.normal(size=(STATES, 6)), random.normal(size=(STATES, 6))
    values = jax.jit(jax.vmap(lambda *a: terms(realization, *a)))(*map(jnp.asarray, arguments))
    return request.param, [np.asarray(v) for v in values]


def test_error_equation(batch):
    name, (left, right, sigma, _, _) = batch
    np.testing.assert_allclose(left, right + sigma, atol=1e-9)
    if name == "all eight":
        assert np.abs(sigma).max() < 1e-9, "at rank six nothing is left over"
    else:
        assert np.abs(left - right).max() > 0.1, "below rank six sigma is what makes it true"


def test_measured_uncertainty_is_the_prescribed_load(batch):
    _, (_, _, _, measured, prescribed) = batch
    np.testing.assert_allclose(measured, prescribed, atol=1e-9)
