"""Correlated errors of sensors as further states of a Kalman filter, behind those of the motion."""

from functools import lru_cache
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.navigation.from_sensors import count_errors
from undertow.core.numerics.number import Number
from undertow.physics.sensors.gauss_markov import CorrelatedErrors
from undertow.physics.sensors.sensor import AbstractSensor

Covariance = Float[Array, "n n"]


class Packing(NamedTuple):
    """How a symmetric matrix is kept as its upper triangle."""

    upper: tuple[np.ndarray, np.ndarray]  # places of the kept entries
    where: np.ndarray  # of each entry of the matrix among the kept ones


@lru_cache
def packing(size: int) -> Packing:
    """Packing of a matrix of that many rows."""
    rows, columns = (index.astype(np.int32) for index in np.triu_indices(size))  # a width that both precisions have
    where = np.zeros((size, size), dtype=np.int32)
    where[rows, columns] = where[columns, rows] = np.arange(len(rows))
    return Packing((rows, columns), where)


def error_states(sensors: tuple[AbstractSensor, ...], first: int) -> list[slice]:
    """States of the correlated errors of each sensor, from state `first` on; an empty slice for one without."""
    states = []
    for sensor in sensors:
        last = first + count_errors(sensor)
        states.append(slice(first, last))
        first = last
    return states


def all_errors(sensors: tuple[AbstractSensor, ...], scale: Number) -> CorrelatedErrors | None:
    """The correlated errors of all sensors together, with deviations times a scale; None where there are none."""
    per_sensor = [sensor.sampling.errors for sensor in sensors if sensor.sampling.errors is not None]
    if not per_sensor:
        return None
    deviations = scale * jnp.concatenate([errors.deviation for errors in per_sensor])
    return CorrelatedErrors(deviations, jnp.concatenate([errors.correlation_time for errors in per_sensor]))


def faded(covariance: Covariance, errors: CorrelatedErrors, elapsed: Number) -> Covariance:
    """The covariance `elapsed` (s) later, whose last states are these errors."""
    motion = len(covariance) - len(errors.deviation)
    decay = jnp.concatenate([jnp.ones(motion), errors.kept(elapsed)])
    growth = jnp.concatenate([jnp.zeros(motion), errors.gained(elapsed)])
    return covariance * decay[:, None] * decay[None, :] + jnp.diag(growth)
