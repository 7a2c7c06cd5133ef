"""What a dive would tell of free parameters: the information of each of its segments, from exact derivatives."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from undertow.logs.run_log import log_of_run
from undertow.studies.identification.dive import RESIDUALS, SENSOR_OF_RESIDUAL, Dive, dive_of
from undertow.studies.identification.model import IdentificationModel, normal_equations
from undertow.studies.identification.segments import Segments, segments_of
from undertow.studies.identification.simulated_dive import SENSORS

_MEASURED = ("position", "velocity")  # with a signal `measured_...` beside
_EXACT = 1e-9  # m, rad, m/s, rad/s: less noise is none
_AT_ONCE = 32  # segments that one program computes: those of candidates and of a script of five minutes alike
_LAGS = 40  # steps over which errors of a navigation filter are correlated at most
# Sensors of a vehicle with an acoustic position, an attitude reference, a DVL and gyros, where a scenario has none.
_USUAL = [SENSORS[name] for name in ("position", "attitude", "body_velocity", "angular_velocity", "position")]


class SimulatedDive(NamedTuple):
    """A simulated dive as an identification would see it, and the noise of its sensors.

    Attributes:
        dive: on its grid.
        noise: standard deviation of a single sample for each kind of residual, (13,); infinite without samples.
        is_usual: whether the noise is that of usual sensors, because the scenario measures without any.
    """

    dive: Dive
    noise: np.ndarray
    is_usual: bool


def dive_of_run(dataset: xr.Dataset, step: float) -> SimulatedDive:
    """The dive of a run.

    Args:
        dataset: with `position` and `measured_position`, and velocities alike.
        step: of the grid, s.
    """
    log = log_of_run(dataset)
    measured = dive_of(log, log["input"], step)
    exact = dict(log.signals) | {f"measured_{name}": log[name] for name in _MEASURED}
    true = dive_of(dataclasses.replace(log, signals=exact), log["input"], step)
    errors = _errors(measured, true)
    counts = measured.counts[:, SENSOR_OF_RESIDUAL]
    noise = np.full(len(RESIDUALS), np.inf)
    for i in np.flatnonzero(counts.any(axis=0)):
        scaled = (errors[:, i] * np.sqrt(counts[:, i]))[counts[:, i] > 0]
        noise[i] = np.sqrt((scaled**2).mean() * _correlation_factor(scaled))
    if noise[np.isfinite(noise)].max() > _EXACT:
        return SimulatedDive(measured, np.maximum(noise, _EXACT), False)
    rate = counts.sum(axis=0) / measured.duration
    usual = np.array([_USUAL[sensor].noise * np.sqrt(rate[i] / _USUAL[sensor].rate) for i, sensor in _kinds()])
    return SimulatedDive(measured, np.where(counts.any(axis=0), usual, np.inf), True)


def _kinds() -> list[tuple[int, int]]:
    return [(i, int(sensor)) for i, sensor in enumerate(SENSOR_OF_RESIDUAL)]


def _errors(measured: Dive, true: Dive) -> np.ndarray:
    """Measured less true of each kind of residual, (steps, 13)."""
    turned = Rotation.from_quat(true.values[:, 3:7], scalar_first=True).inv()
    attitude = (turned * Rotation.from_quat(measured.values[:, 3:7], scalar_first=True)).as_rotvec()
    difference = measured.values - true.values
    return np.hstack([difference[:, :3], attitude, difference[:, 7:14]])


def _correlation_factor(errors: np.ndarray) -> float:
    """By how much the variance of a mean of correlated errors exceeds that of white ones."""
    energy = float((errors**2).sum())
    if not energy > 0:
        return 1.0
    lags = min(_LAGS, len(errors) - 1)
    correlation = [float((errors[lag:] * errors[:-lag]).sum()) / energy for lag in range(1, lags + 1)]
    bound = 2 / np.sqrt(len(errors))
    first_small = next((k for k, rho in enumerate(correlation) if rho < bound), lags)
    return 1.0 + 2.0 * sum(correlation[:first_small])


def information_of(
    model: IdentificationModel,
    z: np.ndarray,
    simulated: SimulatedDive,
    length: float,
    only: Sequence[int] | None = None,
) -> np.ndarray:
    """Information of each segment about the unknowns, what its free begin takes up removed, (S, P, P).

    That of a dive is their sum, and the identity for what is known beforehand.

    Args:
        model: see there.
        z: numbers of parameters and nuisances at which to linearise; zeros are those of the vehicle file.
        simulated: dive and noise.
        length: of the segments, s.
        only: numbers of the segments; None for all.
    """
    dive, noise = simulated.dive, simulated.noise
    segments = segments_of([dive], length)
    numbers = np.arange(len(segments.dive)) if only is None else np.array(only)
    parts = [numbers[first : first + _AT_ONCE] for first in range(0, len(numbers), _AT_ONCE)]
    return np.concatenate([_information(model, z, segments, noise, dive.step, part) for part in parts])


def _information(
    model: IdentificationModel, z: np.ndarray, segments: Segments, noise: np.ndarray, step: float, numbers: np.ndarray
) -> np.ndarray:
    """Information of some segments, with the program for `_AT_ONCE` of them."""
    padded = np.concatenate([numbers, np.repeat(numbers[-1:], _AT_ONCE - len(numbers))])
    segments = jax.tree.map(lambda column: column[padded], segments)
    counts = segments.counts[:, :, SENSOR_OF_RESIDUAL]
    with np.errstate(divide="ignore"):
        weights = np.where(counts > 0, counts / noise**2, 0.0)
    starts = jnp.zeros((len(segments.dive), 12))
    parts = normal_equations(model, jnp.asarray(z), starts, segments, jnp.asarray(weights), step)
    aa, ab, bb = (np.asarray(part) for part in (parts.aa, parts.ab, parts.bb))
    reduction = np.linalg.solve(bb + np.eye(12), ab.transpose(0, 2, 1))
    information = aa - np.einsum("spq,sqr->spr", ab, reduction)
    return (information[: len(numbers)] + information[: len(numbers)].transpose(0, 2, 1)) / 2
