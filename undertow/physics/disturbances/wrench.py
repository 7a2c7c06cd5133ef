"""A constant external force and moment: w_d of Eq. (2)."""

import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import Load
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_AXES
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance


class ConstantWrench(AbstractSmoothDisturbance):
    """w_d is on the left side of Eq. (2), so a positive surge force opposes forward motion."""

    value: Float[Param, " n"] = param("N, N m", "force and moment", symbol="w_d")

    def __check_init__(self):
        checks.finite("value", self.value)

    def at(self, realization, t, pose, load: Load) -> Load:
        if np.shape(self.value) != load.wrench.shape:
            entries = f"have {load.wrench.shape[0]} entries"
            must = f"{entries} ({', '.join(BODY_AXES)})" if pose is not None else entries
            raise BadInput("value", must, f"of shape {np.shape(self.value)}")
        return load._replace(wrench=load.wrench + self.value)


def wrench(value=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)) -> ConstantWrench:
    """Constant load in body axes (N, N m), with the sign of Eq. (2).

    Args:
        value: one entry per axis.
    """
    return ConstantWrench(value)
