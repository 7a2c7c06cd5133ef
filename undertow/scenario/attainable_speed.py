"""Speeds through the water at which the thrusters of a vehicle still balance its drag, whatever the controller is."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core.kept_programs import briefly_compiled
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.unactuated_attitude import acting_directions, body_force, rotations

_DIRECTIONS = 2000
_SHARES = 101  # of a current, tried one after the other
_BALANCED = 0.01  # of the force: what may be left of it


def top_speed(plant: HybridVehicle) -> float:
    """Speed through the water, m/s, that the thrusters exceed in no direction; infinite where they have no limit.

    In a direction the force is at most the sum of what each thruster gives, and the surplus of weight or buoyancy,
    although these also turn the vehicle and push it sideways. Drag balances that force at the speed.
    """
    thrusts = _thrusts(plant)
    if thrusts is None:
        return np.inf
    low, high = thrusts
    along = _sphere(_DIRECTIONS)
    shares = along @ np.asarray(plant.thruster_matrix, dtype=float)[:3]
    body = plant.body
    surplus = abs(float(body.weight) - float(body.buoyancy))
    force = np.maximum(low * shares, high * shares).sum(axis=1) + surplus
    linear, quadratic = (
        np.asarray(damping, dtype=float)[:3, :3] for damping in (body.linear_damping, body.quadratic_damping)
    )
    a = np.einsum("ki,ij,kj->k", along, linear, along)
    b = np.einsum("ki,ij,kj->k", along, quadratic, along * np.abs(along))
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = 2 * force / (a + np.sqrt(a**2 + 4 * b * force))  # a v + b v^2 = force
    return float(np.where(np.isnan(speed), np.inf, speed).max())


def held_speed(plant: HybridVehicle, position: Float[np.ndarray, " 6"], flow: Float[np.ndarray, " 3"]) -> float:
    """Speed of a current, m/s and at most that of `flow`, against which the thrusters hold the vehicle where it is.

    Damping, the moment of the added mass and the surplus of weight or buoyancy are balanced along all directions in
    which the thrusters act; along the others nothing is.

    Args:
        plant: vehicle with thrusters.
        position: that is held, m and rad.
        flow: velocity of the current, world axes, m/s.
    """
    thrusts = _thrusts(plant)
    if thrusts is None or not flow.any():
        return vector_size(flow)
    (rotation,) = rotations(position[None, 3:])
    shares = np.linspace(0.0, 1.0, _SHARES)
    relative_velocity = np.concatenate([-rotation.T @ flow, np.zeros(3)])
    matrix = np.asarray(plant.thruster_matrix, dtype=float)
    down = np.broadcast_to(rotation[2], (_SHARES, 3))
    needed = np.asarray(body_force(plant.body, np.outer(shares, relative_velocity), down)) @ acting_directions(matrix).T
    speed = 0.0
    for share, force in zip(shares, needed, strict=True):
        residual = matrix @ _nearest_thrusts(matrix, force, *thrusts) - force
        if vector_size(residual) > _BALANCED * vector_size(force):
            break
        speed = float(share * vector_size(flow))
    return speed


def _nearest_thrusts(matrix: np.ndarray, force: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Thrusts between their limits whose force is nearest to a given one."""
    unlimited = np.linalg.lstsq(matrix, force)[0]
    if ((low <= unlimited) & (unlimited <= high)).all():
        return unlimited
    from scipy.optimize import lsq_linear  # a fifth of a second, which vehicles with thrust to spare need not wait for

    return lsq_linear(matrix, force, bounds=(low, high)).x


def _thrusts(plant: HybridVehicle) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]] | None:
    """Lowest and highest steady thrusts, N; None where there is no limit, or none is known."""
    limits = _steady_range(plant)
    if limits is None:
        return None
    low, high = (np.asarray(limit, dtype=float) for limit in limits)
    return (low, high) if np.isfinite(low).all() and np.isfinite(high).all() else None


@briefly_compiled
def _steady_range(plant: HybridVehicle):
    actuators = plant.thruster.actuator_model(plant.inputs(), False)
    if actuators.time_constant() is None:  # the steady force is unknown, too
        return None
    held = actuators.quasi_static()
    return held.range(held.init(), jnp.ones(()))


def vector_size(vector: Float[np.ndarray, " k"]) -> float:
    """Euclidean norm, also of entries whose squares are too large for a double."""
    return float(np.hypot.reduce(vector))


def _sphere(count: int) -> Float[np.ndarray, "count 3"]:
    """Unit vectors, evenly over the sphere (Fibonacci lattice), and the axes."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - z**2)
    spiral = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
    return np.concatenate([spiral, np.eye(3), -np.eye(3)])
