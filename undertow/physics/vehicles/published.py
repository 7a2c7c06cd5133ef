"""A `VehicleModel` from published numbers: variants by name, diagonals as matrices, inertia about the body origin."""

from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.core import checks
from undertow.core.arrays import as_array
from undertow.physics.vehicles.vehicle import VehicleModel

Variant = TypeVar("Variant")


class Hull(NamedTuple):
    """One published parameter set, as printed except for axes and signs: forward, starboard, down; matrices positive.

    Matrices may be given by their diagonals. Damping is D nu + D_q (|nu| nu).
    """

    source: str
    mass: float  # kg
    weight: float  # N
    buoyancy: float  # N
    r_g: ArrayLike  # m
    r_b: ArrayLike  # m
    inertia: ArrayLike  # kg m^2, about the centre of gravity
    added_mass: ArrayLike  # kg, kg m, kg m^2
    linear_damping: ArrayLike  # N s/m, N s, N m s
    quadratic_damping: ArrayLike  # N s^2/m^2, N s^2, N m s^2
    inertia_about_origin: bool = False  # printed about the body origin instead
    notes: Mapping[str, str] | None = None  # sources of single parameters
    size: ArrayLike | None = None  # m; length, width, height


class ThrusterLayout(NamedTuple):
    """One published thruster layout, in the same axes."""

    source: str
    positions: ArrayLike  # m
    directions: ArrayLike  # unit vectors of positive thrust
    names: tuple[str, ...] = ()  # of the vehicle's own; () for none, "" for a thruster without


def choose(argument: str, name: str, variants: Mapping[str, Variant]) -> Variant:
    """The variant called `name`.

    Raises:
        BadInput: there is no such variant.
    """
    checks.choice(argument, name, tuple(variants))
    return variants[name]


def assemble(name: str, hull: Hull, layout: ThrusterLayout) -> VehicleModel:
    """Vehicle from one parameter set and one layout, which keeps both sources."""
    inertia, sources = _matrix(hull.inertia), {"*": hull.source}
    if np.any(hull.r_g) and not hull.inertia_about_origin:
        inertia = inertia_about_origin(inertia, hull.mass, hull.r_g)
        sources["inertia"] = f"{hull.source}; moved from the centre of gravity to the body origin"
    sources |= {"thruster_positions": layout.source, "thruster_directions": layout.source}
    return VehicleModel(
        name=name,
        mass=hull.mass,
        weight=hull.weight,
        buoyancy=hull.buoyancy,
        r_g=np.asarray(hull.r_g, dtype=float),
        r_b=np.asarray(hull.r_b, dtype=float),
        inertia=inertia,
        added_mass=_matrix(hull.added_mass),
        linear_damping=_matrix(hull.linear_damping),
        quadratic_damping=_matrix(hull.quadratic_damping),
        thruster_positions=np.asarray(layout.positions, dtype=float),
        thruster_directions=np.asarray(layout.directions, dtype=float),
        sources=sources | dict(hull.notes or {}),
        own_thruster_names=layout.names,
        size=None if hull.size is None else as_array(hull.size),
    )


def inertia_about_origin(inertia: ArrayLike, mass: float, r_g: ArrayLike) -> NDArray:
    """I_o = I_cg + m (|r|^2 1 - r r^T), kg m^2. Parallel-axis theorem; Fossen (2021), ch. 3.

    Args:
        inertia: about the centre of gravity, kg m^2.
        mass: kg.
        r_g: centre of gravity, m.
    """
    r = np.asarray(r_g, dtype=float)
    return np.asarray(inertia, dtype=float) + mass * (r @ r * np.eye(3) - np.outer(r, r))


def _matrix(entries: ArrayLike) -> NDArray:
    array = np.asarray(entries, dtype=float)
    return np.diag(array) if array.ndim == 1 else array
