"""ODIN, the Omni-Directional Intelligent Navigator: a near-spherical vehicle with eight thrusters."""

import numpy as np

from undertow.physics.vehicles.vehicle import VehicleModel

_BOOK = "G. Antonelli, Underwater Robots, 2nd ed., Springer 2006, App. A.4"

_VERTICAL_RADIUS = 0.381 * np.sqrt(0.5)  # m; thrusters 5-8, lever arm 0.381 m about x and y
_HORIZONTAL_RADIUS = 0.508 * np.sqrt(0.5)  # m; thrusters 1-4, on a circle of 0.508 m, pushing tangentially
_CORNERS = np.array([[1, -1, 0], [-1, -1, 0], [-1, 1, 0], [1, 1, 0]], dtype=float)
_TANGENTS = np.sqrt(0.5) * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=float)


def odin() -> VehicleModel:
    """ODIN with the parameters of Antonelli (2006); assumed to be the paper's unnamed vehicle.

    Thrusters 1-4 are horizontal, 5-8 vertical (positive thrust pushes up), both on the four corners counted from
    fore port. In the book's thruster matrix the sign of (Y, thruster 2) reads -; only + gives four corners.
    """
    return VehicleModel(
        name="odin",
        mass=125.0,
        weight=1226.0,
        buoyancy=1224.2,
        r_g=[0.0, 0.0, 0.05],
        r_b=[0.0, 0.0, 0.0],
        inertia=np.diag([8.0, 8.0, 8.0]),
        added_mass=np.diag([62.5, 62.5, 62.5, 0.0, 0.0, 0.0]),
        linear_damping=np.diag([0.0, 0.0, 0.0, 30.0, 30.0, 30.0]),
        quadratic_damping=np.diag([48.0, 48.0, 48.0, 80.0, 80.0, 80.0]),
        thruster_positions=np.concatenate([_HORIZONTAL_RADIUS * _CORNERS, _VERTICAL_RADIUS * _CORNERS]),
        thruster_directions=np.concatenate([_TANGENTS, np.tile([0.0, 0.0, -1.0], (4, 1))]),
        sources={
            "*": _BOOK,
            "buoyancy": "derived: sphere of radius 0.31 m in fresh water; the printed 0.3 m would leave it 117 N heavy",
            "thruster_positions": f"{_BOOK}: lever arms 0.508 m and 0.381 m, corners derived from the thruster matrix",
            "thruster_directions": f"{_BOOK}: thruster matrix, sign of (Y, 2) corrected",
        },
    )
