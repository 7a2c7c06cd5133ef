"""Series-parallel identification model: Eqs. (30)-(34)."""

import equinox as eqx
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.numerics.smoothing import SWITCHES, switch
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]


class SeriesParallel(eqx.Module):
    """A model of the plant driven by the same input; its velocity less that of the plant is the modelling error eps.

    Raises:
        BadInput: a gain negative, the pole or layer not positive.
    """

    pole: Float[Param, "..."] = param("1/s", "filter pole", symbol="alpha_F", default=150.0, source="Table 1")
    compensation_gain: Float[Param, "..."] = param(
        "m/s^2, rad/s^2", "amplitude of the compensation", symbol="omega_bar", default=0.1, source="Table 1"
    )
    compensation_layer: Float[Param, "..."] = param(
        "m/s, rad/s", "boundary layer of the compensation", symbol="phi", default=0.5, source="Table 1"
    )
    switching: str = eqx.field(static=True, default="tanh")

    def __check_init__(self):
        checks.positive("pole", self.pole, "1/s")
        checks.not_negative("compensation_gain", self.compensation_gain)
        checks.positive("compensation_layer", self.compensation_layer)
        checks.choice("switching", self.switching, SWITCHES)

    def error(self, predicted_velocity: PerAxis, velocity: PerAxis) -> PerAxis:
        """eps = x_hat_dot - x_dot, m/s and rad/s. Eq. (31)."""
        return predicted_velocity - velocity

    def compensation(self, error: PerAxis) -> PerAxis:
        """v, m/s^2 and rad/s^2. Eq. (33), Remark 5."""
        return self.compensation_gain * switch(error, self.compensation_layer, self.switching)

    def acceleration(self, error: PerAxis, modelled: PerAxis, estimate: PerAxis) -> PerAxis:
        """x_hat_ddot, m/s^2 and rad/s^2. Eq. (32).

        Args:
            error: eps.
            modelled: F + G u with the input that was applied; Eq. (30) without d.
            estimate: d_hat.
        """
        return -self.pole * error + modelled + estimate - self.compensation(error)
