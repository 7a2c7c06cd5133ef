"""INTECO MLS2EM, a ball between two electromagnets: its constants and its statics."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.param import param, sources_field

_BALKO = "Balko and Rosinova 2017"
_MILAN = "INTECO manual, as used at Politecnico di Milano (062020-Lab-Mechatronics)"

PerCoil = Float[Array, "2"]

# Balko and Rosinova 2017; which mass goes with which diameter is inferred from their order.
_BALLS = {"balko_rosinova_16g": (0.016, 0.033), "balko_rosinova_23g": (0.023, 0.040), "balko_rosinova": (0.039, 0.054)}
_COIL = {"current_gain": 4.4, "current_offset": -0.4, "smallest_current": 0.03884, "largest_current": 2.38}
_MANUAL_COIL = {
    "current_gain": 2.5165,
    "current_offset": 0.0243,
    "smallest_current": 0.0243,
    "largest_current": 2.5165 + 0.0243,
}


class LevitationRig(eqx.Module):
    """Ball and coils; z points down from the upper magnet to the ball. Coil 1 is above, coil 2 below.

    Raises:
        BadInput: a constant is not positive, or the ball does not fit between the magnets.
    """

    mass: Float[Array, ""] = param("kg", "mass of the ball", symbol="m")
    diameter: Float[Array, ""] = param("m", "diameter of the ball", symbol="2 r")
    magnet_distance: Float[Array, ""] = param("m", "between the magnets", symbol="H")
    force_factor: Float[Array, ""] = param("", "1/2 of F = 1/2 dL/dz I^2; the manual omits it", symbol="k_f")
    current_gain: Float[Array, ""] = param("A", "current per duty cycle", symbol="k_i")
    current_offset: Float[Array, ""] = param("A", "current at no duty cycle, extrapolated", symbol="c_i")
    smallest_current: Float[Array, ""] = param("A", "what flows at rest", symbol="I_min")
    largest_current: Float[Array, ""] = param("A", "what the drive can give", symbol="I_max")
    inductance: Float[Array, ""] = param(
        "H", "gained by a coil that the ball touches", symbol="FemP1", default=1.7521e-2
    )
    inductance_reach: Float[Array, ""] = param(
        "m", "gap over which it falls e times", symbol="FemP2", default=5.8231e-3
    )
    lag_slope: Float[Array, ""] = param(
        "m s", "time constant at contact times `lag_reach`", symbol="fiP1", default=1.4142e-4
    )
    lag_reach: Float[Array, ""] = param("m", "gap over which the lag falls e times", symbol="fiP2", default=4.5626e-3)
    lag_range: Float[Array, ""] = param("m", "largest gap at which the lag is known; held beyond", default=0.016)
    resistance: Float[Array, ""] = param("ohm", "of a coil", symbol="R", default=4.17, source=_MILAN)
    gravity: Float[Array, ""] = param("m/s^2", "gravity", symbol="g", default=9.81)
    sources: tuple = sources_field()

    def __check_init__(self):
        for name in self.__dataclass_fields__:
            if name not in ("current_offset", "sources"):
                checks.positive(name, getattr(self, name))
        checks.finite("current_offset", self.current_offset)
        checks.positive("magnet_distance - diameter", self.travel, "m")

    @property
    def travel(self) -> Float[Array, ""]:
        """Largest z, m: there the ball touches the lower magnet."""
        return self.magnet_distance - self.diameter

    def gaps(self, z: Float[Array, "1"]) -> PerCoil:
        """From each magnet to the ball, m."""
        return jnp.concatenate([z, self.travel - z])

    def pull(self, z: Float[Array, "1"]) -> PerCoil:
        """Acceleration of the ball per squared current, m/(s^2 A^2): up, so negative, by coil 1, down by coil 2."""
        slope = self.inductance / self.inductance_reach * jnp.exp(-self.gaps(z) / self.inductance_reach)
        return jnp.array([-1.0, 1.0]) * self.force_factor * slope / self.mass

    def lag(self, z: Float[Array, "1"]) -> PerCoil:
        """Time constants of the currents, s: longer the nearer the ball.

        The published exponential goes to nothing (12 us for coil 2 with the ball at 10 mm), which no coil does: beyond
        the 16 mm in which the rig can measure z, and so was identified, it is held.
        """
        return self.lag_slope / self.lag_reach * jnp.exp(-jnp.minimum(self.gaps(z), self.lag_range) / self.lag_reach)

    def demand(self, duty: PerCoil) -> PerCoil:
        """Squared steady current, A^2, of duty cycles U in [0, 1]: I = k_i U + c_i within the coil's limits."""
        current = self.current_gain * duty + self.current_offset
        return jnp.clip(current, self.smallest_current, self.largest_current) ** 2

    def duty(self, demand: PerCoil) -> PerCoil:
        """Duty cycles that give a squared current in the long run: what leaves for the drive."""
        return (jnp.sqrt(demand) - self.current_offset) / self.current_gain


def _balko(name: str) -> LevitationRig:
    mass, diameter = _BALLS[name]
    sources = {"*": _BALKO, "resistance": _MILAN}
    return LevitationRig(mass, diameter, magnet_distance=0.1, force_factor=0.5, **_COIL, sources=sources)


def _manual() -> LevitationRig:
    return LevitationRig(0.06054, 0.06125, 0.098, 1.0, **_MANUAL_COIL, sources={"*": _MILAN})


RIGS = {name: lambda name=name: _balko(name) for name in _BALLS} | {"inteco_polimi": _manual}
