"""What water does to a body, but for buoyancy: Fossen (2021), ch. 6, 8 and 10, in plain NumPy.

Written anew rather than called, as a second opinion: the rigid body's own part is left to the engine, velocities
through the water and over ground are kept apart, and accelerating water pushes with what it would have pushed the
water in the body's place (Froude and Krylov).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.outside.mujoco_engine.frames import cross
from undertow.physics.vehicles.vehicle import VehicleModel


class UniformFlow(NamedTuple):
    """How the water moves, everywhere alike; world axes north, east, down."""

    velocity: ArrayLike = (0.0, 0.0, 0.0)  # m/s
    acceleration: ArrayLike = (0.0, 0.0, 0.0)  # m/s^2


class Hydrodynamics:
    """Added mass and damping of a vehicle, body axes forward, starboard, down.

    Args:
        vehicle: whose coefficients.
        held: whether the engine holds the added mass as a body; otherwise it is a force.
    """

    def __init__(self, vehicle: VehicleModel, held: bool = False):
        self.added_mass = np.asarray(vehicle.added_mass) * (not held)
        self._held = np.asarray(vehicle.added_mass) * held
        self._linear, self._quadratic = np.asarray(vehicle.linear_damping), np.asarray(vehicle.quadratic_damping)
        self._displaced = float(vehicle.buoyancy) * float(vehicle.mass) / float(vehicle.weight)
        self._r_b = np.asarray(vehicle.r_b)

    def wrench(self, rotation: NDArray, nu: NDArray, water: UniformFlow) -> NDArray:
        """Force and moment on the body at the origin, N and N m, but for -M_A nu_dot.

        Args:
            rotation: body -> world.
            nu: velocity over ground, m/s and rad/s.
            water: how it moves.
        """
        flow, rising = (rotation.T @ np.asarray(rate) for rate in water)
        through = nu - np.concatenate([flow, np.zeros(3)])
        flow_rate = np.concatenate([rising - cross(nu[3:], flow), np.zeros(3)])  # seen from the turning body
        # A rigid body's added mass does not see steady flow (Galileo), only its acceleration.
        held = self._held @ np.concatenate([rising, np.zeros(3)])
        push = self._displaced * rising
        return (
            self.added_mass @ flow_rate
            + held
            - _momentum_change(self.added_mass, through)
            - self._linear @ through
            - self._quadratic @ (np.abs(through) * through)
            + np.concatenate([push, cross(self._r_b, push)])
        )


def _momentum_change(mass_matrix: NDArray, nu: NDArray) -> NDArray:
    """C(nu) nu: rate of the momentum M nu because the axes turn and the origin moves. Kirchhoff's equations."""
    linear, angular = np.split(mass_matrix @ nu, 2)
    return np.concatenate([cross(nu[3:], linear), cross(nu[3:], angular) + cross(nu[:3], linear)])
