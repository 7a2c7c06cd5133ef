"""How far a vehicle leans about an axis that its thrusters cannot turn it about, as a BlueROV2 in pitch.

Only weight and buoyancy right it there. Drag, added mass and thrusters that act above or below the centre of gravity
turn it, the more the faster the water passes it.
"""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import ArrayLike, Float

from undertow.core.kept_programs import briefly_compiled
from undertow.core.measurement import BODY_AXES
from undertow.core.runtime import double_outside_runs
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.vehicles.body import Body

_WEAK = 0.05  # of the strongest direction: what thrusters do less along is left to the vehicle
_UNACTUATED = 0.5  # of a unit force or moment: what thrusters leave of it at least
_STEEPEST, _ANGLES = 1.4, 57  # rad; angles at which the moment is computed
_AXES = {3: "roll", 4: "pitch"}


class Lean(NamedTuple):
    """The largest lean in some flows."""

    axis: str
    angle: float  # rad; infinite where no angle up to 1.4 rad is at rest
    row: int  # which of the flows


@double_outside_runs
def largest_lean(
    plant: HybridVehicle, angles: Float[np.ndarray, "k 3"], relative_velocity: Float[np.ndarray, "k 3"]
) -> Lean | None:
    """The largest lean at which a vehicle is at rest about an axis that is not actuated; None where all are.

    The directions that thrusters act along are balanced by any control law, so that a moment along the others must be
    zero: n . (C(nu) nu + D(nu) + g) = 0 with n . B = 0, whatever the thrusts are. An angle is at rest if the moment
    rights the vehicle on both sides of it; the least one counts.

    Args:
        plant: vehicle with thrusters, which act along surge, sway and heave; otherwise None is returned.
        angles: of the target: roll, pitch, yaw, rad.
        relative_velocity: velocities of the target through the water, world axes, m/s.
    """
    unactuated = np.eye(6) - acting_directions(plant.thruster_matrix)
    if (np.diagonal(unactuated)[:3] > _UNACTUATED).any():
        return None
    rotation = rotations(angles)
    leans = [
        _lean_about(plant.body, axis, unactuated, rotation, relative_velocity)
        for axis in _AXES
        if unactuated[axis, axis] > _UNACTUATED
    ]
    return max(leans, key=lambda lean: lean.angle, default=None)


def acting_directions(thruster_matrix: ArrayLike) -> Float[np.ndarray, "6 6"]:
    """Projection of forces and moments on the directions along which thrusters act."""
    matrix = np.asarray(thruster_matrix, dtype=float)
    return matrix @ np.linalg.pinv(matrix, rcond=_WEAK)


def unactuated_axes(thruster_matrix: ArrayLike) -> tuple[str, ...]:
    """Names of the axes, of `BODY_AXES`, along and about which thrusters act hardly or only together with others.

    Args:
        thruster_matrix: force and moment per thrust, (6, N).
    """
    acting = np.diagonal(acting_directions(thruster_matrix))
    return tuple(axis for axis, share in zip(BODY_AXES, acting, strict=True) if 1 - share > _UNACTUATED)


def rotations(angles: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3 3"]:
    """Rotations body -> world of roll, pitch and yaw, rad, in NumPy."""
    roll, pitch, yaw = angles.T
    return _turns(2, yaw) @ _turns(1, pitch) @ _turns(0, roll)


def _lean_about(
    body: Body, axis: int, unactuated: np.ndarray, rotation: np.ndarray, relative_velocity: np.ndarray
) -> Lean:
    angles = np.linspace(-_STEEPEST, _STEEPEST, _ANGLES)
    turned = rotation[:, None] @ _turns(axis - 3, angles)
    flow = np.einsum("kaij,ki->kaj", turned, relative_velocity)
    nu = np.concatenate([flow, np.zeros_like(flow)], axis=-1)
    moment = np.asarray(body_force(body, nu.reshape(-1, 6), turned[:, :, 2].reshape(-1, 3))) @ unactuated[:, axis]
    leans = [_at_rest(angles, row) for row in moment.reshape(len(rotation), -1)]
    worst = int(np.argmax(leans))
    return Lean(_AXES[axis], leans[worst], worst)


@briefly_compiled
def body_force(body: Body, nu: Float[ArrayLike, "k 6"], down: Float[ArrayLike, "k 3"]) -> Float[jax.Array, "k 6"]:
    """C(nu) nu + D(nu) + g at body velocities through the water and directions of gravity, N and N m."""
    force = lambda velocity, gravity: body.coriolis(velocity) + body.damping(velocity) + body.restoring(gravity)
    return jax.vmap(force)(nu, down)


def _at_rest(angles: np.ndarray, moment: np.ndarray) -> float:
    """The least angle at which a moment on the left side of the equation of motion passes zero upwards."""
    before = np.flatnonzero((moment[:-1] <= 0) & (moment[1:] > 0))
    part = moment[before] / (moment[before] - moment[before + 1])
    return float(np.abs(angles[before] + part * (angles[1] - angles[0])).min(initial=np.inf))


def _turns(axis: int, angles: np.ndarray) -> Float[np.ndarray, "k 3 3"]:
    """Rotations about a body axis, by the formula of Rodrigues."""
    cross = np.cross(np.eye(3), np.eye(3)[axis])  # times a vector: the axis x the vector
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + sine * cross + (1 - cosine) * cross @ cross
