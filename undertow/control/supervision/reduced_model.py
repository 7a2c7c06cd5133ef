"""The nominal model of a plant some of whose actuators are no longer used."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import AbstractDynamics, Gain, Measurement, Model, Outputs
from undertow.core.numerics.linear_algebra import inverse_symmetric, matvec, solve_symmetric

PerActuator = Float[Array, " m"]
PerAxis = Float[Array, " n"]

# Weights of the axes of a vehicle where not all accelerations can be given: surge, sway, heave, roll, pitch, yaw.
# A vehicle that can no longer give roll and heave separately gives up roll, which its weight rights.
VEHICLE_PRIORITY = (1.0, 1.0, 1.0, 0.1, 0.1, 0.3)


def default_priority(model: Model) -> PerAxis:
    """Weight of each axis where not all accelerations can be given: `VEHICLE_PRIORITY` for a vehicle, else 1."""
    angles = model.coordinates.angles
    vehicle = angles == (False, False, False, True, True, True)
    return jnp.asarray(VEHICLE_PRIORITY if vehicle else (1.0,) * len(angles), dtype=float)


class ReducedDynamics(AbstractDynamics):
    """Dynamics with the columns of unused actuators taken out of the gain.

    While every actuator is in use, `invert` is that of the whole model, to the last bit. Otherwise it is the least
    weighted residual, min |S (G f - a)|^2 + delta |f|^2, with S the priority of an axis over its largest acceleration
    and delta the square root of the rounding: exact to about delta where G has full rank, and the axes of little
    priority give way where it has not.
    """

    whole: AbstractDynamics
    used: PerActuator  # 1, or 0 for an actuator that is not used
    priority: PerAxis

    def drift(self, y: Measurement) -> Outputs:
        return self.whole.drift(y)

    def gain(self, y: Measurement) -> Gain:
        return self.whole.gain(y) * self.used[None, :]

    def invert(self, y: Measurement, acceleration: Outputs) -> PerActuator:
        reduced = lambda: least_forces(self.whole.gain(y), self.used, self.priority, acceleration)
        return jax.lax.cond((self.used < 1).any(), reduced, lambda: self.whole.invert(y, acceleration))


class ReducedActuators(AbstractActuatorModel):
    """Actuators of which those that are not used get the command 0 and cannot be asked for a force."""

    whole: AbstractActuatorModel
    used: PerActuator

    def max_bandwidth(self, sampled):
        return self.whole.max_bandwidth(sampled)

    def time_constant(self):
        return self.whole.time_constant()

    def init(self):
        return self.whole.init()

    def update_from_report(self, state, report):
        return self.whole.update_from_report(state, report)

    def range(self, state, rate):
        low, high = self.whole.range(state, rate)
        return self._masked(low), self._masked(high)

    def force(self, state, u):
        return self.whole.force(state, u)

    def command(self, state, force, rate):
        return self._masked(self.whole.command(state, force, rate))

    def target_of(self, state, u, rate):
        return self.whole.target_of(state, u, rate)

    def advance(self, state, u, dt):
        return self.whole.advance(state, u, dt)

    def dead_zone(self):
        return self.whole.dead_zone()

    def quasi_static(self):
        return ReducedActuators(self.whole.quasi_static(), self.used)

    def _masked(self, value) -> PerActuator:
        return jnp.where(self.used > 0, value, 0.0)


def reduced(model: Model, used: PerActuator, priority: PerAxis) -> Model:
    """The model with the actuators that are in use."""
    dynamics, coordinates, actuators = model
    return Model(ReducedDynamics(dynamics, used, priority), coordinates, ReducedActuators(actuators, used))


def least_forces(gain: Gain, used: PerActuator, priority: PerAxis, acceleration: Outputs) -> PerActuator:
    """Forces of the actuators in use that come nearest to an acceleration; see `ReducedDynamics`."""
    scale, scaled, normal = _weighted(gain, used, priority)
    return matvec(scaled.T, solve_symmetric(normal, scale * acceleration))


def attained_share(gain: Gain, used: PerActuator, priority: PerAxis) -> PerAxis:
    """Share of an acceleration demanded of one axis alone that `least_forces` gives it: the diagonal of G G#."""
    scale, _, normal = _weighted(gain, used, priority)
    square = normal - _damping(gain) * jnp.eye(len(scale), dtype=gain.dtype)
    return (square * inverse_symmetric(normal)).sum(-1)


def _weighted(gain: Gain, used: PerActuator, priority: PerAxis) -> tuple[PerAxis, Gain, Float[Array, "n n"]]:
    """S, S G of the actuators in use, and S G G^T S + delta."""
    reach = jnp.abs(gain).sum(-1)
    scale = priority / jnp.where(reach > 0, reach, 1.0)
    scaled = scale[:, None] * gain * used[None, :]
    square = (scaled[:, None, :] * scaled[None, :, :]).sum(-1)
    return scale, scaled, square + _damping(gain) * jnp.eye(len(scale), dtype=gain.dtype)


def _damping(gain: Gain) -> float:
    """delta: the square root of the rounding, about 1.5e-8 in double precision."""
    return float(jnp.finfo(gain.dtype).eps) ** 0.5
