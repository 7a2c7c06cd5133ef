"""Two coupled axes with drift and one state of them: for laws of which one step is written out in NumPy."""

import jax
import numpy as np

from undertow.core.contracts import Measurement, Target

DT = 0.02  # s
# x_ddot = G u + F x + H v
G, F, H = np.array([[2.0, 0.3], [0.5, 1.5]]), np.array([[-0.4, 0.1], [0.2, -0.6]]), np.array([[-0.5, 0.2], [0.1, -0.3]])
X, V = np.array([0.3, -0.2]), np.array([0.4, -0.7])
Y = Measurement(X, V)
DRIFT = F @ X + H @ V
GOAL = Target(np.array([0.8, -0.5]), np.array([0.2, -0.1]), np.array([0.1, -0.4]))
E, R, A = GOAL.position - X, GOAL.velocity - V, GOAL.acceleration
GAINS = np.array([[1.0, 2.0], [3.0, 1.5]])  # on E and R, per axis
THETA = np.array([[0.9, -0.9, 0.2, 0.4, -0.1], [0.3, -0.5, 0.8, -0.2, 0.6]])  # weights of five sets


def same(found, expected, **more):
    """Checks every number of two trees."""
    for leaf, value in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
        np.testing.assert_allclose(leaf, value, **({"rtol": 1e-10, "atol": 1e-12} | more))
