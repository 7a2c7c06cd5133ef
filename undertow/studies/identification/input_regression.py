"""Accelerations in the weak form as sums: linear in the gain of each input, whatever its sign."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.identified_vehicle import AxisActuation, PriorVehicle
from undertow.studies.identification.model import IdentificationModel, Unknowns, model_of
from undertow.studies.identification.weak_form import body_balance, weights_of, wrenches_of
from undertow.studies.identification.weak_problem import weak_problem

Order = tuple[int, ...]  # input j acts along the force of input order[j]

_LOOSENED = 3.0  # factor on the prior deviations of everything that is not a gain
_ROUNDS = 3  # of weights
_ANY_GAIN = 1e-6  # prior information of a gain
_OVERLAP = 2.0  # factor on variances, as windows overlap by half
_OF_INPUTS = ("thruster_gain", "reverse_gain", "lag", "command_delay", "axis_")


class InputRegression(NamedTuple):
    """What the inputs do along the forces of each other, and what the body does.

    Attributes:
        of_inputs: accelerations at the gains of the file, (rows, forces, inputs).
        of_body: their change with the other parameters, (rows, parameters).
        target: what they add up to, (rows,).
        usable: (rows / 6, 6).
    """

    of_inputs: np.ndarray
    of_body: np.ndarray
    target: np.ndarray
    usable: np.ndarray


class GainSolution(NamedTuple):
    """Gains over those of the file, their standard errors, and the mean size of what remains, on each axis."""

    gains: np.ndarray
    deviations: np.ndarray
    error: np.ndarray  # NaN where nothing is measured

    @property
    def mean_error(self) -> float:
        """Geometric mean over the axes."""
        measured = self.error[np.isfinite(self.error) & (self.error > 0)]
        return float(np.exp(np.log(measured).mean())) if len(measured) else np.inf


def regression_of(prior: PriorVehicle, parameters: Sequence[FreeParameter], dives: Sequence[Dive]) -> InputRegression:
    """The sums for dives with equal steps, at the prior values."""
    problem = weak_problem(dives)
    of_body = [parameter for parameter in parameters if not parameter.name.startswith(_OF_INPUTS)]
    model = model_of(prior, of_body)
    z = np.zeros(len(Unknowns(tuple(of_body), len(dives)).all()))
    is_per_axis = isinstance(prior.actuation, AxisActuation)
    count = dives[0].inputs.shape[1]
    gain_names = [f"axis_gain.{axis}" for axis in BODY_AXES] if is_per_axis else _thruster_gains(count)
    settings = {p.name: jnp.asarray(p.prior) for p in parameters if p.name.startswith(_OF_INPUTS)}
    settings = {name: value for name, value in settings.items() if name not in ("thruster_gain", "command_delay")}
    unit_gains = jnp.asarray([float(settings.get(name, 1.0)) for name in gain_names])
    test, slope = jnp.asarray(problem.test), jnp.asarray(problem.slope)
    residuals, derivative, wrenches = (
        np.asarray(part)
        for part in _parts(
            model, jnp.asarray(z), tuple(gain_names), unit_gains, settings, problem.segments, test, slope, problem.step
        )
    )
    inverse_mass = np.asarray(model.candidate(jnp.asarray(z)).vehicle.body.inverse_mass_matrix)
    # Wrench of input j along the force of each other: w_j = f_j d_j with the direction d_j of the file.
    directions = _directions(wrenches)
    strengths = np.einsum("jswa,ja->swj", wrenches, directions)
    length = problem.segments.values.shape[1]
    inputs = np.einsum("wk,skj->swj", problem.test, problem.segments.inputs[:, -length:])
    signs = np.where((inputs * strengths).sum(axis=(0, 1)) < 0, -1.0, 1.0)
    directions, strengths = signs[:, None] * directions, signs * strengths
    accelerations = directions @ inverse_mass.T  # (N, 6)
    of_inputs = np.einsum("ia,swj->swaij", accelerations, strengths).reshape(-1, count, count)
    return InputRegression(
        of_inputs=of_inputs,
        of_body=_LOOSENED * derivative.reshape(-1, derivative.shape[-1]),
        target=-residuals.reshape(-1),
        usable=problem.usable.reshape(-1, 6),
    )


def _thruster_gains(count: int) -> list[str]:
    return [f"thruster_gain.T{j + 1}" for j in range(count)]


def _directions(wrenches: np.ndarray) -> np.ndarray:
    """Unit vectors along which each input pushes, but for their sign, (N, 6); zero of one that never does."""
    flat = wrenches.reshape(len(wrenches), -1, 6)
    strongest = np.abs(flat).sum(axis=2).argmax(axis=1)
    pushes = flat[np.arange(len(flat)), strongest]
    return pushes / np.maximum(np.linalg.norm(pushes, axis=1, keepdims=True), 1e-12)


@eqx.filter_jit
def _parts(model: IdentificationModel, z, names: tuple[str, ...], gains, settings, segments, test, slope, step):
    """Accelerations of the prior body without inputs, their derivative, and the mean wrench of each input."""

    def residuals(unknowns, segment):
        candidate = model.candidate(unknowns)
        body = candidate.vehicle.body
        nu, force = body_balance(body, candidate.sensing(segment.dive), segment)
        return slope @ nu + (test @ force) @ body.inverse_mass_matrix.T

    def of_segment(segment):
        value, derivative = jax.linearize(lambda unknowns: residuals(unknowns, segment), z)
        return value, jnp.moveaxis(jax.vmap(derivative)(jnp.eye(z.shape[0])), 0, -1)

    def alone(row):
        actuation = model.prior.actuation.with_values(settings | dict(zip(names, row, strict=True)))
        one = lambda segment: test @ wrenches_of(actuation, segment.inputs, segment.values, step)
        return jax.vmap(one)(segments)

    value, derivative = jax.vmap(of_segment)(segments)
    return value, derivative, jax.vmap(alone)(jnp.diag(gains))


def solved(regression: InputRegression, order: Order, left_out: tuple[int, ...] = ()) -> GainSolution:
    """Gains when input j acts along the force of input order[j]; that of one that is left out is zero."""
    count = len(order)
    of_inputs = np.stack([regression.of_inputs[:, order[j], j] for j in range(count)], axis=1)
    of_inputs[:, list(left_out)] = 0.0
    columns = np.hstack([of_inputs, regression.of_body])
    prior = np.diag(np.concatenate([np.full(count, _ANY_GAIN), np.ones(regression.of_body.shape[1])]))
    solution = np.zeros(columns.shape[1])
    information = prior
    residuals = -regression.target
    for _ in range(_ROUNDS):
        weights = weights_of(residuals.reshape(-1, 6), regression.usable).reshape(-1)
        weighted = weights[:, None] * columns
        information = weighted.T @ columns + prior
        solution = np.linalg.solve(information, weighted.T @ regression.target)
        residuals = columns @ solution - regression.target
    sizes = np.where(regression.usable, np.abs(residuals).reshape(-1, 6), np.nan)
    error = np.array([np.nanmean(column) if np.isfinite(column).any() else np.nan for column in sizes.T])
    variances = np.maximum(np.diagonal(np.linalg.inv(information)), 0.0)  # below zero by rounding, where nothing moves
    return GainSolution(solution[:count], np.sqrt(_OVERLAP * variances)[:count], error)
