"""The surface of still water, above which a vehicle has no buoyancy."""

from jaxtyping import Float

from undertow.core import checks
from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance, SumOfDisturbances, with_surface
from undertow.physics.disturbances.waves import Waves


class StillSurface(AbstractSmoothDisturbance):
    """A level surface at a depth above the world's origin.

    Raises:
        BadInput: depth not finite.
    """

    depth: Float[Param, ""] = param("m", "depth of the world's origin")

    def __check_init__(self):
        checks.finite("depth", self.depth, "m")

    def at(self, realization, t, pose, load: Load) -> Load:
        return with_surface(load, pose, self.depth, 0.0 * self.depth)


class UnderSurface(AbstractDisturbance):
    """A disturbance, with the same realization as without, under the surface of still water."""

    inner: AbstractDisturbance
    surface: StillSurface

    def realize(self, key):
        return self.inner.realize(key)

    def at(self, realization, t, pose, load: Load) -> Load:
        return self.surface.at((), t, pose, self.inner.at(realization, t, pose, load))

    def jumps(self, duration: float) -> tuple[float, ...]:
        return self.inner.jumps(duration)


def surface(depth: float = 0.0) -> StillSurface:
    """Surface of still water. Waves have their own; without either, the water has no end.

    Near the surface, buoyancy, added mass, damping and thrust fade with the share of the hull that is out of the water.

    Args:
        depth: of the world's origin below the surface, m.
    """
    return StillSurface(depth)


def stated_depths(disturbance: AbstractDisturbance) -> list[float]:
    """Depths of the world's origin below the surface that a disturbance states, m; the first one counts."""
    if isinstance(disturbance, UnderSurface):
        return [*stated_depths(disturbance.inner), float(disturbance.surface.depth)]
    members = disturbance.members if isinstance(disturbance, SumOfDisturbances) else (disturbance,)
    return [float(one.depth) for one in members if isinstance(one, Waves | StillSurface)]
