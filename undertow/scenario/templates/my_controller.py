# my_controller.py
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractController, Model
from undertow.core.param import Param, param
from undertow.core.signals import Signal


class SlidingMode(AbstractController):
    """Integral sliding mode with a boundary layer. Gains are one number, or one per axis."""

    model: Model
    slope: Float[Param, "..."] = param("1/s", "rate of decay on the surface", symbol="lambda", range=(0.1, 5.0))
    reaching: Float[Param, "..."] = param("m/s^2, rad/s^2", "switching amplitude", symbol="K", range=(0.05, 5.0))
    layer: Float[Param, "..."] = param("m/s, rad/s", "boundary layer", symbol="phi", range=(0.02, 2.0))

    def __check_init__(self):
        for name in ("slope", "reaching", "layer"):
            checks.positive(name, getattr(self, name))

    def init(self, y, r):
        return jnp.zeros_like(y.position)  # integral of the error, m s, rad s

    def command(self, z, y, r):
        s, nominal = self._surface(z, y, r)
        acceleration = nominal + self.reaching * jnp.clip(s / self.layer, -1, 1)
        u = self.model.dynamics.invert(y, acceleration - self.model.dynamics.drift(y))
        return u, {"surface": s}

    def advance(self, z, y, r, u_applied, dt):
        s, _ = self._surface(z, y, r)
        return z + dt * jnp.where(jnp.abs(s) < self.layer, self.model.coordinates.tracking_error(y, r).error, 0.0)

    def _surface(self, z, y, r):
        """s, and the acceleration that keeps it where it is."""
        e, e_dot, acceleration = self.model.coordinates.tracking_error(y, r)
        s = e_dot + 2 * self.slope * e + self.slope**2 * z
        return s, acceleration + 2 * self.slope * e_dot + self.slope**2 * e

    def signals(self):
        return {"surface": Signal(("axis",), "[axis]/s", "distance s from the sliding surface")}


def my_controller(model, slope=2.0, reaching=3.0, layer=0.3) -> SlidingMode:
    """Sliding-mode control with a boundary layer.

    Args:
        model: nominal model of the plant.
        slope: rate of decay on the surface, 1/s.
        reaching: switching amplitude, m/s^2 and rad/s^2.
        layer: boundary layer, m/s and rad/s.
    """
    return SlidingMode(model, slope, reaching, layer)
