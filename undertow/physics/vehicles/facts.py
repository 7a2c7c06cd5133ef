"""A vehicle for the linter: the numbers as given, before they are validated."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from undertow.physics.vehicles.published import inertia_about_origin
from undertow.physics.vehicles.vehicle import VehicleModel

FRESH_WATER = 1000.0  # kg/m^3


class Facts(NamedTuple):
    """Numbers of a vehicle. Body axes forward, starboard, down; matrices positive."""

    name: str
    mass: float  # kg
    weight: float  # N
    buoyancy: float  # N
    r_g: Float[np.ndarray, "3"]  # m
    r_b: Float[np.ndarray, "3"]  # m
    inertia: Float[np.ndarray, "3 3"]  # kg m^2, about the centre of gravity
    added_mass: Float[np.ndarray, "6 6"]
    linear_damping: Float[np.ndarray, "6 6"]
    quadratic_damping: Float[np.ndarray, "6 6"]
    positions: Float[np.ndarray, "N 3"]  # m
    directions: Float[np.ndarray, "N 3"]  # of any length
    size: Float[np.ndarray, "3"] | None = None  # m; length, width, height
    printed_matrix: Float[np.ndarray, "6 N"] | None = None  # as in the vehicle's source
    water_density: float | None = None  # kg/m^3
    angles: Mapping[str, float] = MappingProxyType({})  # degrees; key of a thruster's angle -> value as given

    @property
    def displaced_mass(self) -> float:
        """Mass of the displaced water, kg; with the vehicle's own gravity where it is plausible."""
        gravity = self.weight / self.mass
        return self.buoyancy / (gravity if 9 < gravity < 11 else 9.81)

    @property
    def scale(self) -> float:
        """Least size of the vehicle, m: its longest thruster arm, or the side of a cube of its volume."""
        side = np.cbrt(self.displaced_mass / (self.water_density or FRESH_WATER))
        return float(max(self.lever, side))

    @property
    def lever(self) -> float:
        """Distance of the farthest thruster from the centre of gravity, m."""
        return float(np.linalg.norm(self.positions - self.r_g, axis=1).max())

    @property
    def mass_matrix(self) -> Float[np.ndarray, "6 6"]:
        """M = M_RB + M_A about the body origin."""
        x, y, z = self.mass * self.r_g
        lever = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        origin = inertia_about_origin(self.inertia, self.mass, self.r_g)
        return np.block([[self.mass * np.eye(3), -lever], [lever, origin]]) + self.added_mass

    @property
    def thruster_matrix(self) -> Float[np.ndarray, "6 N"]:
        """B from the poses, with directions normalised to length 1."""
        lengths = np.linalg.norm(self.directions, axis=1, keepdims=True)
        unit = self.directions / np.where(lengths > 0, lengths, 1.0)
        return np.concatenate([unit, np.cross(self.positions, unit)], axis=1).T

    @property
    def radii_of_gyration(self) -> Float[np.ndarray, "3"]:
        """sqrt(I / m) about axes through the centre of gravity, m."""
        return np.sqrt(np.abs(np.diag(self.inertia)) / self.mass)


def facts_of(vehicle: VehicleModel) -> Facts:
    """Facts of a vehicle made in Python or from the catalogue."""
    numbers = {
        name: np.asarray(getattr(vehicle, name), dtype=float)
        for name in ("r_g", "r_b", "added_mass", "linear_damping", "quadratic_damping")
    }
    mass = float(vehicle.mass)
    return Facts(
        name=vehicle.name,
        mass=mass,
        weight=float(vehicle.weight),
        buoyancy=float(vehicle.buoyancy),
        inertia=inertia_about_origin(np.asarray(vehicle.inertia), -mass, numbers["r_g"]),  # shift back from origin
        positions=np.asarray(vehicle.thruster_positions, dtype=float),
        directions=np.asarray(vehicle.thruster_directions, dtype=float),
        **numbers,  # pyright: ignore[reportArgumentType] - arrays and numbers in one mapping
    )
