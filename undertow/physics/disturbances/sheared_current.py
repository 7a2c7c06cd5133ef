"""A steady current that changes with depth."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Load
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance, body_of, with_water


class ShearedCurrent(AbstractSmoothDisturbance):
    """Horizontal velocities at given depths, linear in between, constant above and below.

    The water is assumed uniform over the vehicle, with the velocity at its origin.

    Raises:
        BadInput: depths that do not increase, or another number of velocities.
    """

    depths: Float[Param, " k"] = param("m", "depths, increasing")
    velocities: Float[Param, "k 2"] = param("m/s", "velocity there: north, east")

    def __check_init__(self):
        shape = np.shape(self.depths)
        if len(shape) != 1 or shape[0] < 2:
            raise BadInput("depths", "be a list of two or more depths", f"of shape {shape}")
        if np.shape(self.velocities) != (shape[0], 2):
            got = f"of shape {np.shape(self.velocities)}"
            raise BadInput("velocities", f"have {shape[0]} rows (north, east), one per depth", got)
        checks.finite("depths", self.depths, "m")
        checks.finite("velocities", self.velocities, "m/s")
        if not checks.assumed(lambda depths: (depths[1:] > depths[:-1]).all(), self.depths):
            raise BadInput("depths", "increase", np.asarray(self.depths).tolist())

    def at(self, realization, t, pose, load: Load) -> Load:
        down = body_of(pose).position[2]
        north, east = jax.vmap(jnp.interp, in_axes=(None, None, 1))(down, self.depths, self.velocities)
        return with_water(load, pose, jnp.stack([north, east, jnp.zeros_like(north)]), jnp.zeros(3))


def sheared_current(depths=(0.0, 20.0), velocities=((0.8, 0.0), (0.1, 0.0))) -> ShearedCurrent:
    """Current that changes with depth.

    Args:
        depths: m below the origin, increasing.
        velocities: m/s, one pair (north, east) per depth.
    """
    return ShearedCurrent(depths, velocities)
