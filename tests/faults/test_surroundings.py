"""An obstacle pushes only where it is touched, and a tether pulls only where it is taut."""

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import Pose
from undertow.physics.faults.mode import Presence
from undertow.physics.faults.surroundings_modes import Contact, TetherSnag
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import linear_voltage
from undertow.physics.vehicles import odin

NO_LOAD = hybrid_vehicle(odin(), linear_voltage()).no_load()


def force(fault, severity, positions, velocities):
    """North component of the force on an upright vehicle, N, at each position and velocity along north."""

    @jax.jit
    @jax.vmap
    def of_one(position, velocity):
        along = jnp.array([1.0, 0.0, 0.0])
        pose = Pose(position * along, jnp.eye(3), velocity * along)
        return -fault.load(Presence(jnp.asarray(True), jnp.ones(()), severity), pose, NO_LOAD).wrench[0]

    return np.asarray(of_one(jnp.asarray(positions), jnp.asarray(velocities)))


def test_an_obstacle_neither_pulls_nor_pushes_from_afar():
    obstacle = Contact((1.0, 0.0, 0.0), 1e4, 500.0)
    found = force(obstacle, jnp.asarray(2.0), [1.9, 1.9, 2.1, 2.1, 2.1], [0.0, 3.0, 0.0, 1.0, -4.0])
    np.testing.assert_allclose(found, [0.0, 0.0, -1e3, -1.5e3, 0.0], atol=1e-6)


def test_a_tether_is_slack_within_its_length():
    tether = TetherSnag((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.5)
    found = force(tether, jnp.asarray(100.0), [1.0, 1.49, 1.6, 4.0, -2.5], np.zeros(5))
    np.testing.assert_allclose(found, [0.0, 0.0, -10.0, -250.0, 100.0], atol=1e-6)
