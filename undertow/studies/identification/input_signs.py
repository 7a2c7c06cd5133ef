"""Which way each input pushes, whether two are swapped, and which do nothing.

Output error cannot find a thruster that pushes the other way: its gain is positive there. In the weak form the gains are
linear, so that their signs are seen at once, and how well the dive would be explained if two inputs were swapped.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.finding import Finding
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.identified_vehicle import AxisActuation, PriorVehicle
from undertow.studies.identification.model import IdentificationModel, Unknowns, model_of
from undertow.studies.identification.weak_form import body_balance, weak_problem, weights_of, wrenches_of

_LOOSENED = 3.0  # factor on the prior deviations of everything that is not a gain
_SURE = 4.0  # standard errors
_NOTHING = 0.1  # of the gain that the file gives
_MUCH_BETTER = 0.6  # factor on what remains unexplained
_ROUNDS = 3  # of weights
_OF_INPUTS = ("thruster_gain", "reverse_gain", "lag", "command_delay", "axis_")


class InputGains(NamedTuple):
    """Gains of inputs along the forces that the file gives them.

    Attributes:
        names: of the inputs.
        gains: over those of the file.
        deviations: their standard errors.
        swapped: pairs of inputs that explain the dives much better the other way round.
        findings: in words.
    """

    names: tuple[str, ...]
    gains: np.ndarray
    deviations: np.ndarray
    swapped: tuple[tuple[int, int], ...]
    findings: tuple[Finding, ...]


class _Regression(NamedTuple):
    """Accelerations as a sum: of what the inputs do along the forces of each other, and of what the body does."""

    of_inputs: np.ndarray  # (rows, N forces, N inputs)
    of_body: np.ndarray  # (rows, parameters), prior standard deviations
    target: np.ndarray  # (rows,)
    usable: np.ndarray  # (rows / 6, 6)


def input_gains(
    prior: PriorVehicle,
    parameters: Sequence[FreeParameter],
    dives: Sequence[Dive],
    names: Sequence[str] = (),
) -> InputGains:
    """The gain of each input by the weak form, free of sign, and what is strange about it.

    Args:
        prior: vehicle before any dive.
        parameters: what is free; all gains are.
        dives: with equal steps.
        names: of the inputs; () for T1, T2, ... or the axes.
    """
    regression, names = _regression(prior, parameters, dives, tuple(names))
    order = tuple(range(len(names)))
    swapped: list[tuple[int, int]] = []
    gains, deviations, error = _solved(regression, order)
    while len(swapped) < len(names) // 2:
        pairs = [pair for pair in itertools.combinations(range(len(names)), 2) if _are_free(pair, swapped)]
        if not pairs:
            break
        trials = [_solved(regression, _swap(order, pair)) for pair in pairs]
        best = int(np.argmin([trial[2] for trial in trials]))
        if not trials[best][2] < _MUCH_BETTER * error:
            break
        swapped.append(pairs[best])
        order = _swap(order, pairs[best])
        gains, deviations, error = trials[best]
    findings = _findings(names, gains, deviations, swapped)
    return InputGains(names, gains, deviations, tuple(swapped), tuple(findings))


def _are_free(pair: tuple[int, int], swapped: list[tuple[int, int]]) -> bool:
    return not any(index in earlier for earlier in swapped for index in pair)


def _swap(order: tuple[int, ...], pair: tuple[int, int]) -> tuple[int, ...]:
    swapped = list(order)
    swapped[pair[0]], swapped[pair[1]] = order[pair[1]], order[pair[0]]
    return tuple(swapped)


def _regression(
    prior: PriorVehicle, parameters: Sequence[FreeParameter], dives: Sequence[Dive], names: tuple[str, ...]
) -> tuple[_Regression, tuple[str, ...]]:
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
        for part in _parts(model, jnp.asarray(z), tuple(gain_names), unit_gains, settings, problem.segments, test, slope, problem.step)
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
    return (
        _Regression(
            of_inputs=of_inputs,
            of_body=_LOOSENED * derivative.reshape(-1, derivative.shape[-1]),
            target=-residuals.reshape(-1),
            usable=problem.usable.reshape(-1, 6),
        ),
        names or tuple(BODY_AXES if is_per_axis else (f"T{j + 1}" for j in range(count))),
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


def _solved(regression: _Regression, order: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, float]:
    """Gains, their standard errors, and the mean size of what remains unexplained, in units of the noise at first."""
    count = len(order)
    # Input j of the log acts along the force of input order[j].
    of_inputs = np.stack([regression.of_inputs[:, order[j], j] for j in range(count)], axis=1)
    columns = np.hstack([of_inputs, regression.of_body])
    prior = np.diag(np.concatenate([np.full(count, 1e-6), np.ones(regression.of_body.shape[1])]))
    solution = np.zeros(columns.shape[1])
    information = prior
    residuals = -regression.target
    for _ in range(_ROUNDS):
        weights = weights_of(residuals.reshape(-1, 6), regression.usable).reshape(-1)
        weighted = weights[:, None] * columns
        information = weighted.T @ columns + prior
        solution = np.linalg.solve(information, weighted.T @ regression.target)
        residuals = columns @ solution - regression.target
    usable = regression.usable.reshape(-1)
    scale = np.where(usable, np.abs(regression.target), 0.0).reshape(-1, 6).sum(axis=0)
    sizes = np.where(usable, np.abs(residuals), 0.0).reshape(-1, 6).sum(axis=0)
    error = float((sizes[scale > 0] / scale[scale > 0]).mean()) if (scale > 0).any() else 1.0
    deviations = np.sqrt(np.diagonal(np.linalg.inv(information)))[:count]
    return solution[:count], deviations, error


def _findings(names, gains, deviations, swapped) -> list[Finding]:
    findings = []
    for first, second in swapped:
        findings.append(
            Finding(
                "input",
                f"{names[first]} and {names[second]}",
                "refused",
                f"{names[first]} and {names[second]} are swapped: the motion follows each as the file says of the other",
                f"Swap their columns in the mapping of the input, or the thrusters in the vehicle file",
            )
        )
    for name, gain, deviation in zip(names, gains, deviations, strict=True):
        if gain < -_SURE * deviation:
            sentence = f"{name} pushes the other way than the file says (gain {gain:.2f} +- {deviation:.2f} of the file's)"
            remedy = "Write its column with a minus in the mapping of the input, or turn it round in the vehicle file"
            findings.append(Finding("input", name, "refused", sentence, remedy))
        elif abs(gain) + 2 * deviation < _NOTHING:
            sentence = f"{name} does nothing that can be seen (gain {gain:.3f} +- {deviation:.3f} of the file's)"
            remedy = "Check its plug, its propeller, and which column of the log is its command"
            findings.append(Finding("input", name, "note", sentence, remedy))
    return findings
