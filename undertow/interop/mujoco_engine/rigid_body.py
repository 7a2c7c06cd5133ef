"""Mass, centre and inertia of rigid bodies, put together and taken apart; any axes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

_CLOSE = 1e-9  # share of the largest entry by which a matrix may miss a pattern


class RigidBody(NamedTuple):
    """What an engine for rigid bodies knows of one."""

    mass: float  # kg
    centre: NDArray  # m
    inertia: NDArray  # about the centre, kg m^2

    def without(self, mass: float, point: ArrayLike) -> "RigidBody":
        """The rest, after a point mass (kg) at a point (m) has been taken out of it."""
        rest = self.mass - mass
        at = np.asarray(point, dtype=float)
        centre = (self.mass * self.centre - mass * at) / rest
        removed = rest * mass / self.mass * spread(centre - at)
        return RigidBody(rest, centre, self.inertia - removed)


def spread(r: NDArray) -> NDArray:
    """|r|^2 1 - r r^T: inertia of 1 kg at r."""
    return r @ r * np.eye(3) - np.outer(r, r)


def about_centre(mass: float, centre: ArrayLike, inertia_about_origin: ArrayLike) -> RigidBody:
    """Rigid body from its inertia (kg m^2) about the origin: the parallel-axis theorem, backwards."""
    r = np.asarray(centre, dtype=float)
    return RigidBody(float(mass), r, np.asarray(inertia_about_origin, dtype=float) - float(mass) * spread(r))


def as_rigid_body(mass_matrix: ArrayLike) -> RigidBody | None:
    """The rigid body with a 6 x 6 mass matrix (kg, kg m, kg m^2, about the origin); None where there is none.

    A rigid body has one mass for all directions, one centre, and no principal inertia above the sum of the others.
    Added mass seldom is like that: a plate has nearly all of it across, none along.
    """
    matrix = np.asarray(mass_matrix, dtype=float)
    mass = np.trace(matrix[:3, :3]) / 3
    small = _CLOSE * np.abs(matrix).max()
    if not mass > small:
        return None
    lever = matrix[3:, :3] / mass
    centre = np.array([lever[2, 1], lever[0, 2], lever[1, 0]])
    body = about_centre(mass, centre, matrix[3:, 3:])
    translation = np.abs(matrix[:3, :3] - mass * np.eye(3)).max() <= small
    coupling = np.abs(lever + lever.T).max() * mass <= small
    return body if translation and coupling and is_possible(body.inertia) else None


def is_possible(inertia: NDArray) -> bool:
    """Whether some distribution of mass has this inertia about its centre."""
    low, middle, high = np.linalg.eigvalsh(inertia)
    return bool(low >= -_CLOSE * abs(high) and low + middle >= (1 - _CLOSE) * high)
