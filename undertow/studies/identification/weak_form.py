"""A first estimate within a second or so: the weak form of the equation of motion.

The equation is multiplied by smooth functions that vanish outside of a second or two, and integrated by parts: measured
velocities take the place of accelerations, and no noise is differentiated. What is left is a problem of least squares
that is almost linear, without any motion to be simulated.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.contracts import Water
from undertow.core.numerics.integrators import rk4
from undertow.core.numerics.rotations import rotation_from_quaternion
from undertow.physics.vehicles.body import Body, seen_from_water
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.identified_vehicle import AbstractActuation, PriorVehicle
from undertow.studies.identification.model import IdentificationModel, Unknowns, model_of
from undertow.studies.identification.prediction import Sensing, delayed
from undertow.studies.identification.segments import Segments
from undertow.studies.identification.weak_problem import WeakProblem, weak_problem

_ITERATIONS = 8
_LARGEST_STEP = 1.0  # prior standard deviations
_CONVERGED = 0.01
_HUBER = 3.0
_NEIGHBOURS = 4  # windows before and after whose residuals are not independent
_FARTHEST = 2.0  # prior standard deviations, beyond which output error should not begin


class FirstEstimate(NamedTuple):
    """What the weak form says.

    Attributes:
        z: of the parameters, at most 2 prior standard deviations from 0: where output error may begin.
        values: of the parameters by name.
        deviations: standard errors of the values, by name; without the share of the noise that biases products of
            measurements.
        explained: share of the variance of the acceleration along each axis, surge to yaw, that the estimate
            explains; NaN where the motion along an axis was not measured.
    """

    z: np.ndarray
    values: dict[str, float]
    deviations: dict[str, float]
    explained: np.ndarray


def first_estimate(prior: PriorVehicle, parameters: Sequence[FreeParameter], dives: Sequence[Dive]) -> FirstEstimate:
    """Values and standard errors of parameters by the weak form.

    Args:
        prior: vehicle before any dive.
        parameters: what is free.
        dives: with equal steps. Equations of motions that were not measured are left out.
    """
    problem = weak_problem(dives)
    model = model_of(prior, parameters)
    unknowns = Unknowns(tuple(parameters), len(dives))
    least, z = unknowns.least(), np.zeros(len(unknowns.all()))
    for _ in range(_ITERATIONS):
        residuals, derivative = _evaluated(model, z, problem)
        weights = weights_of(residuals, problem.usable)
        information, gradient = _normal(residuals, derivative, weights, z)
        change = _bounded_step(information, gradient, z, least)
        z = z + change
        if np.abs(change).max() < _CONVERGED:
            break
    residuals, derivative = _evaluated(model, z, problem)
    weights = weights_of(residuals, problem.usable)
    information, _ = _normal(residuals, derivative, weights, z)
    deviations = np.sqrt(np.diagonal(_covariance(information, residuals, derivative, weights)))
    count = len(parameters)
    slopes = [(p.value(x + 1e-4) - p.value(x - 1e-4)) / 2e-4 for p, x in zip(parameters, z[:count], strict=True)]
    return FirstEstimate(
        z=np.clip(z[:count], np.maximum(-_FARTHEST, least[:count]), _FARTHEST),
        values={p.name: float(p.value(x)) for p, x in zip(parameters, z[:count], strict=True)},
        deviations={
            p.name: float(abs(slope) * d) for p, slope, d in zip(parameters, slopes, deviations[:count], strict=True)
        },
        explained=_explained(problem, residuals, weights),
    )


def _evaluated(model: IdentificationModel, z: np.ndarray, problem: WeakProblem) -> tuple[np.ndarray, np.ndarray]:
    """Residuals (S, W, 6) in m/s^2 and rad/s^2, and their derivative (S, W, 6, unknowns)."""
    test, slope = jnp.asarray(problem.test), jnp.asarray(problem.slope)
    found = _residuals_and_derivative(model, jnp.asarray(z), problem.segments, test, slope, problem.step)
    residuals, derivative = (np.asarray(part) for part in found)
    return np.where(problem.usable, residuals, 0.0), np.where(problem.usable[..., None], derivative, 0.0)


@eqx.filter_jit
def _residuals_and_derivative(model: IdentificationModel, z, segments: Segments, test, slope, step):
    def of_segment(segment):
        residuals = lambda unknowns: _weak_residuals(model, unknowns, segment, test, slope, step)
        value, derivative = jax.linearize(residuals, z)
        return value, jnp.moveaxis(jax.vmap(derivative)(jnp.eye(z.shape[0])), 0, -1)

    return jax.vmap(of_segment)(segments)


def _weak_residuals(model: IdentificationModel, z, segment: Any, test, slope, step) -> Float[Array, "W 6"]:
    """Accelerations: multiplied by the masses, they would be smallest for a vehicle without masses and forces."""
    candidate = model.candidate(z)
    sensing = candidate.sensing(segment.dive)
    nu, force = body_balance(candidate.vehicle.body, sensing, segment)
    inputs = delayed(segment.inputs, sensing.command_delay / step)
    wrenches = wrenches_of(candidate.vehicle.actuation, inputs, segment.values, step)
    return slope @ nu + (test @ (force + wrenches)) @ candidate.vehicle.body.inverse_mass_matrix.T


def body_balance(body: Body, sensing: Sensing, segment: Any) -> tuple[Array, Array]:
    """Velocity through the water (m/s, rad/s), and force on the body (N, N m) without that of its actuators.

    Both at each step of a segment, (length, 6).
    """

    def at_step(measured):
        rotation = rotation_from_quaternion(measured[3:7])
        nu = measured[7:13] - jnp.concatenate([jnp.zeros(3), sensing.rate_bias])
        seen = seen_from_water(Water(sensing.current, jnp.zeros(3)), rotation, nu, body.gravity)
        force = -body.coriolis(seen.nu) - body.damping(seen.nu) - body.restoring(seen.down)
        return seen.nu, force

    return jax.vmap(at_step)(segment.values)


def wrenches_of(actuation: AbstractActuation, inputs: Array, values: Array, step) -> Float[Array, "length 6"]:
    """Force and moment of the actuators at the middle of each step.

    Args:
        actuation: what the inputs drive.
        inputs: of the run-in and the segment, (run-in + length, N).
        values: measured motion, (length, 14).
        step: s.
    """

    def advance(state, u):
        solved = actuation.solved(state, u, step)
        if solved is not None:
            return solved.end, solved.mean
        after = rk4(lambda t, x: actuation.dynamics(x, u), 0.0, state, step)
        return after, jax.tree.map(lambda a, b: (a + b) / 2, state, after)

    before = inputs.shape[0] - values.shape[0]
    at_begin, _ = jax.lax.scan(advance, actuation.initial_state(), inputs[:before])
    _, states = jax.lax.scan(advance, at_begin, inputs[before:])
    return jax.vmap(actuation.wrench)(states, inputs[before:], values[:, 7:13])


def weights_of(residuals: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """1/variance of each residual (..., 6), less for outliers (Huber), 0 where it is not usable."""
    weights = np.zeros(residuals.shape)
    for axis in range(6):
        of_axis = usable[..., axis]
        if of_axis.any():
            sizes = np.abs(residuals[..., axis])
            noise = max(1.4826 * float(np.median(sizes[of_axis])), 1e-9)
            robust = np.minimum(1.0, _HUBER * noise / np.maximum(sizes, 1e-12))
            weights[..., axis] = np.where(of_axis, robust / noise**2, 0.0)
    return weights


def _normal(residuals, derivative, weights, z) -> tuple[np.ndarray, np.ndarray]:
    """Information and gradient, what was known beforehand included."""
    columns = derivative.reshape(-1, len(z))
    weighted = weights.reshape(-1, 1) * columns
    return weighted.T @ columns + np.eye(len(z)), weighted.T @ residuals.reshape(-1) + z


def _bounded_step(information, gradient, z, least) -> np.ndarray:
    """Change of the unknowns; those that would go below their smallest value stay at it."""
    free = np.ones(len(z), dtype=bool)
    change = np.zeros(len(z))
    for _ in range(len(z)):
        right = -gradient[free] - information[np.ix_(free, ~free)] @ change[~free]
        change[free] = np.linalg.solve(information[np.ix_(free, free)], right)
        too_low = free & (z + change < least)
        if not too_low.any():
            break
        change[too_low] = (least - z)[too_low]
        free &= ~too_low
    return change * min(1.0, _LARGEST_STEP / max(float(np.abs(change).max()), 1e-12))


def _covariance(information, residuals, derivative, weights) -> np.ndarray:
    """Covariance that allows for residuals of neighbouring windows that are alike: A^-1 B A^-1, not below A^-1."""
    scores = np.einsum("swa,swap->swp", weights * residuals, derivative)
    middle = np.einsum("swp,swq->pq", scores, scores)
    for lag in range(1, min(_NEIGHBOURS, scores.shape[1] - 1) + 1):
        cross = np.einsum("swp,swq->pq", scores[:, lag:], scores[:, :-lag])
        middle += (1 - lag / (_NEIGHBOURS + 1)) * (cross + cross.T)
    inverse = np.linalg.inv(information)
    sandwich = inverse @ (middle + np.eye(len(information))) @ inverse
    return sandwich + np.diag(np.maximum(np.diagonal(inverse) - np.diagonal(sandwich), 0.0))


def _explained(problem: WeakProblem, residuals: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Share of the variance of each acceleration that the forces of the estimate explain, outliers at less weight."""
    accelerations = -np.einsum("wk,ska->swa", problem.slope, problem.segments.values[:, :, 7:13])
    explained = np.full(6, np.nan)
    for axis in range(6):
        usable = problem.usable[..., axis]
        weight, acceleration = weights[usable, axis], accelerations[usable, axis]
        total = (weight * acceleration**2).sum()
        if total > 0:
            explained[axis] = 1 - (weight * residuals[usable, axis] ** 2).sum() / total
    return explained
