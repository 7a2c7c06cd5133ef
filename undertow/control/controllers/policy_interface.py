"""What a learned policy sees and what its actions mean, in `controllers/policy.py` as in the Gymnasium environments."""

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import AbstractCoordinates, Measurement, Model, Target
from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_AXES
from undertow.core.numerics.linear_algebra import matvec

ACTIONS = ("normalised", "input", "wrench")

# Bounds of the observation: what lies beyond is shown as the bound. m, m/s, rad/s.
FARTHEST, FASTEST = 100.0, 20.0

Observation = Float[Array, " observed"]
Action = Float[Array, " a"]


class PolicyInterface(eqx.Module):
    """Observation of a policy and meaning of its action.

    The observation is, in this order: the tracking error of every output (m, rad; angles in [-pi, pi)), its rate (m/s,
    rad/s), for a vehicle the velocity in body axes (u, v, w, m/s; p, q, r, rad/s) and the attitude (unit quaternion w,
    x, y, z, body -> world), and the action before.

    The action is one number per actuator within [-1, 1] (`normalised`: -1 and 1 are the limits of the input), one input
    per actuator in its unit (`input`), or six numbers within [-1, 1] (`wrench`: shares of the largest acceleration
    along and about each body axis that the thrusters can give).
    """

    coordinates: AbstractCoordinates
    actuators: AbstractActuatorModel  # without dynamics
    low: Float[Array, " m"]  # input of the action -1, in its unit
    high: Float[Array, " m"]  # of the action 1
    of_wrench: Float[Array, "m 6"] | None  # forces per action; None where the action is no wrench
    kind: str = eqx.field(static=True)
    body: bool = eqx.field(static=True)

    def first(self) -> Action:
        """The action before the first one: none."""
        return jnp.zeros(self.actions)

    @property
    def actions(self) -> int:
        """Length of an action."""
        return len(BODY_AXES) if self.kind == "wrench" else self.low.shape[0]

    def observation(self, y: Measurement, r: Target, before: Action) -> Observation:
        """Observation of a measurement and a target, within `bounds`; `before` is the last action."""
        error = self.coordinates.difference(r.position, y.position)
        parts = [error, r.velocity - y.velocity]
        if self.body:
            assert y.body is not None
            parts += [y.body.nu, y.body.attitude]
        bound = jnp.asarray(self.bounds())
        outputs = jnp.clip(jnp.concatenate(parts), -bound, bound)
        return jnp.concatenate([outputs, before])

    def bounds(self) -> np.ndarray:
        """Largest sizes of the observation's entries, without those of the action before."""
        turns = np.array(self.coordinates.angles, dtype=bool)
        error = np.where(turns, math.pi, FARTHEST)
        return np.concatenate([error, np.full(len(turns) + 6 * self.body, FASTEST), np.ones(4 * self.body)])

    def action_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest action."""
        if self.kind == "input":
            return np.asarray(self.low), np.asarray(self.high)
        return -np.ones(self.actions), np.ones(self.actions)

    def within_bounds(self, action: Action) -> Action:
        """The action cut off at its bounds."""
        low, high = (self.low, self.high) if self.kind == "input" else (-1.0, 1.0)
        return jnp.clip(action, low, high)

    def command(self, action: Action) -> Float[Array, " m"]:
        """Input that an action within its bounds stands for."""
        if self.kind == "input":
            return action
        if self.of_wrench is None:
            return jnp.where(action < 0, -action * self.low, action * self.high)
        forces, unused = matvec(self.of_wrench, action), jnp.zeros(())
        low, high = self.actuators.range(self.actuators.init(), unused)
        return self.actuators.command(self.actuators.init(), jnp.clip(forces, low, high), unused)


def policy_interface_of(model: Model, action: str, scale: Any = None) -> PolicyInterface:
    """The interface for a nominal model.

    Args:
        model: from `plant.model()`.
        action: one of `ACTIONS`.
        scale: input that the action 1 stands for, in the unit of the input; None for its limit, or the input for a
            force of 1 where there is none.

    Raises:
        BadInput: another word, a scale that is not positive, or a wrench for a plant without body axes.
    """
    checks.choice("action", action, ACTIONS)
    body_model = model.in_body_axes()
    body = bool(body_model.coordinates.axes)
    actuators = body_model.actuators.quasi_static()
    still, unused = jnp.zeros(len(model.coordinates.angles)), jnp.zeros(())
    effect = body_model.dynamics.gain(model.coordinates.measurement(still, still))
    per_actuator = lambda value: jnp.broadcast_to(value, effect.shape[1:])
    least_force, largest_force = map(per_actuator, actuators.range(actuators.init(), unused))
    if scale is not None:
        checks.positive("scale", scale)
        low, high = per_actuator(-jnp.asarray(scale, dtype=float)), per_actuator(jnp.asarray(scale, dtype=float))
    else:
        unit = lambda force, sign: jnp.where(jnp.isfinite(force), force, sign)  # without a limit
        low, high = (
            actuators.command(actuators.init(), unit(force, sign), unused)
            for force, sign in ((least_force, -1.0), (largest_force, 1.0))
        )
    of_wrench = None
    if action == "wrench":
        if not body:
            raise BadInput("action", "be normalised or input for a plant without body axes", action)
        limited = lambda low, high: (abs(low) < np.inf).all() & (abs(high) < np.inf).all()
        if not checks.assumed(limited, least_force, largest_force):
            hint = "Give the thruster a supply"
            raise BadInput("action", "be normalised or input for thrusters without limits", action, hint=hint)
        # In units of the largest acceleration that the thrusters give in each axis, which is the largest wrench times
        # the inverse of the mass matrix.
        of_wrench = jnp.linalg.pinv(effect) * (jnp.abs(effect) @ jnp.minimum(-least_force, largest_force))[None]
    return PolicyInterface(model.coordinates, actuators, per_actuator(low), per_actuator(high), of_wrench, action, body)
