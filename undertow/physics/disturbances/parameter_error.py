"""Parameter errors of the nominal model: the true vehicle differs from it."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractDisturbance, Load, ModelScaling
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import with_scaling

_RANGES = ("mass", "damping", "restoring", "thrust")


class ParameterError(AbstractDisturbance):
    """Factors on M, D, g and thrust of the true vehicle, each uniformly distributed in a range; the model keeps 1.

    Raises:
        BadInput: a range that is not low <= high, or a mass not positive.
    """

    mass: Float[Param, "2"] = param("", "range of the factor on M and C")
    damping: Float[Param, "2"] = param("", "range of the factor on D")
    restoring: Float[Param, "2"] = param("", "range of the factor on g")
    thrust: Float[Param, "2"] = param("", "range of the factor on thrust")

    def __check_init__(self):
        for name in _RANGES:
            span = getattr(self, name)
            checks.length(name, span, 2, "lowest, highest")
            checks.not_negative(name, span)
            if not checks.assumed(lambda span: span[0] <= span[1], span):
                raise BadInput(name, "be (lowest, highest)", np.asarray(span).tolist())
        checks.positive("mass", self.mass)

    def realize(self, key) -> ModelScaling:
        shares = jax.random.uniform(key, (4,), dtype=self.mass.dtype)
        low, high = jnp.stack([getattr(self, name) for name in _RANGES]).T
        return ModelScaling(*(low + shares * (high - low)))

    def at(self, realization: ModelScaling, t, pose, load: Load) -> Load:
        return with_scaling(load, pose, realization)

    def jumps(self, duration: float) -> tuple[float, ...]:
        return ()


def parameter_error(mass=(0.9, 1.1), damping=(0.7, 1.3), restoring=(0.9, 1.1), thrust=(0.9, 1.1)) -> ParameterError:
    """True vehicle that differs from the nominal model; different for every seed.

    Args:
        mass: lowest and highest factor on M (and C); equal for a fixed error.
        damping: likewise on D.
        restoring: likewise on g.
        thrust: likewise on the thrust of every thruster.
    """
    return ParameterError(mass, damping, restoring, thrust)
