"""A weight that is picked up and put down."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks, contracts
from undertow.core.contracts import AbstractDisturbance, Load
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import with_payload

_LARGEST_GRAVITY = 9.84  # m/s^2, at the poles, rounded up


class PickedUp(AbstractDisturbance):
    """A point mass that is part of the vehicle from `start` to `stop`: its weight, its inertia, its moments.

    It has the vehicle's velocity when it is picked up and put down, so there is no impulse.

    Raises:
        BadInput: mass negative, heavier in water than in air, or stop not after start.
    """

    mass: Float[Param, ""] = param("kg", "mass")
    weight: Float[Param, ""] = param("N", "weight in water; negative if it floats")
    point: Float[Param, "3"] = param("m", "where it is held, body axes")
    start: Float[Param, ""] = param("s", "when it is picked up")
    stop: Float[Param, ""] = param("s", "when it is put down")

    def __check_init__(self):
        checks.not_negative("mass", self.mass, "kg")
        checks.finite("weight", self.weight, "N")
        checks.length("point", self.point, 3, "forward, starboard, down")
        checks.finite("point", self.point, "m")
        if not checks.assumed(lambda weight, mass: weight <= _LARGEST_GRAVITY * mass, self.weight, self.mass):
            got = f"{float(self.weight):g} N in water for {float(self.mass):g} kg"
            raise BadInput("weight", f"be at most its weight in air ({_LARGEST_GRAVITY * float(self.mass):.3g} N)", got)
        if not checks.assumed(lambda start, stop: start < stop, self.start, self.stop):
            raise BadInput("stop", f"be later than start ({float(self.start):g} s)", f"{float(self.stop):g} s")

    def realize(self, key) -> tuple[()]:
        return ()

    def at(self, realization, t, pose, load: Load) -> Load:
        held = jnp.where((t >= self.start) & (t < self.stop), 1.0, 0.0)
        return with_payload(load, pose, contracts.Payload(held * self.mass, held * self.weight, self.point))

    def jumps(self, duration: float) -> tuple[float, ...]:
        times = np.array([float(self.start), float(self.stop)])
        return tuple(times[(times > 0) & (times < duration)].tolist())


def payload(mass=2.0, weight=12.0, point=(0.2, 0.0, 0.1), start=0.0, stop=1e9) -> PickedUp:
    """Payload that the vehicle picks up and carries.

    Args:
        mass: kg.
        weight: in water, N; negative if it floats.
        point: where it is held, m: forward, starboard, down.
        start: when it is picked up, s.
        stop: when it is put down, s.
    """
    return PickedUp(mass, weight, point, start, stop)
