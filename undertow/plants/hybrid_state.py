"""The state of a vehicle with thrusters."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import Pose
from undertow.core.status import Status
from undertow.numerics.linear_algebra import matvec
from undertow.numerics.rotations import Kinematics, quaternion_from_euler, rotation_from_quaternion
from undertow.plants.hybrid_power import PowerState

_ENVELOPE = 1e3  # m, m/s, rad/s; far beyond any vehicle


class VehicleState(NamedTuple):
    """State of body, thrusters and power. The attitude is a quaternion: no singularity, no trigonometry."""

    position: Float[Array, "3"]  # m, world
    attitude: Float[Array, "4"]  # unit quaternion, body -> world
    nu: Float[Array, "6"]  # m/s, rad/s, body
    thrusters: Any
    power: PowerState = PowerState()  # battery and ledger

    def pose(self) -> Pose:
        """Where the body is and how it moves."""
        rotation = rotation_from_quaternion(self.attitude)
        return Pose(self.position, rotation, matvec(rotation, self.nu[:3]))

    def status(self) -> Array:
        """Status code: Euler angles exist, and nothing is far beyond any vehicle."""
        third_row = rotation_from_quaternion(self.attitude)[2]
        near_vertical = third_row[1] ** 2 + third_row[2] ** 2 < 1e-6
        far = (jnp.abs(self.position) > _ENVELOPE).any() | (jnp.abs(self.nu) > _ENVELOPE).any()
        code = jnp.where(near_vertical, int(Status.PITCH_SINGULAR), int(Status.OK))
        return jnp.where(far, int(Status.DIVERGED), code)


def state_at(position: Any, velocity: Any, thrusters: Any, power: PowerState) -> VehicleState:
    """State with given outputs and rates of outputs, in Euler angles; zero where None."""
    position = jnp.zeros(6) if position is None else position
    velocity = jnp.zeros(6) if velocity is None else velocity
    attitude = quaternion_from_euler(position[3:])
    nu = Kinematics(rotation_from_quaternion(attitude)).to_body(velocity)
    return VehicleState(position[:3], attitude, nu, thrusters, power)
