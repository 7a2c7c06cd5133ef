"""Errors of a form of the thruster on bench records, with their derivatives, by compiled functions."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.runtime import in_precision
from undertow.studies.identification.bench.bench_response import BenchResponse, held_command, response_over_time
from undertow.studies.identification.bench.bench_table import BenchTable
from undertow.studies.identification.bench.thruster_form import ThrusterForm, joined
from undertow.studies.identification.free_parameters import FreeParameter

_PRECISION = "float64"
_FINEST = 1e-6  # of the largest value, below which differences are rounding
_LEAST_NOISE = 1e-5  # of the largest value


class BenchProblem:
    """Records, a form of the thruster, and what that form predicts.

    Attributes:
        form: of the thruster.
        tables: records, row after row.
        parameters: unknowns.
        present: whether each quantity was measured in each row, (rows, quantities) of `form.measured`.
        least_noise: standard deviation of the rounding of each quantity, (quantities,).
    """

    def __init__(self, form: ThrusterForm, tables: Sequence[BenchTable]):
        self.form, self.tables = form, tuple(tables)
        self.parameters = form.parameters(tables)
        measured = np.stack([joined(tables, name) for name in form.measured], axis=1)
        self.present = np.isfinite(measured)
        self.largest = np.where(self.present, np.abs(measured), 0.0).max(axis=0)
        self.least_noise = np.array([_rounding(column[np.isfinite(column)]) for column in measured.T])
        self._measured = np.where(self.present, measured, 0.0)
        self._errors = jax.jit(self._error_of)
        self._slopes = jax.jit(jax.jacfwd(self._error_of))
        self._thrust = jax.jit(self._thrust_of)
        self._thrust_slopes = jax.jit(jax.jacfwd(self._thrust_of))

    def errors(self, z: np.ndarray) -> np.ndarray:
        """Predicted less measured, (rows, quantities); 0 where nothing was measured."""
        with in_precision(_PRECISION):
            return np.asarray(self._errors(jnp.asarray(z)))

    def slopes(self, z: np.ndarray) -> np.ndarray:
        """Derivatives of the errors by the unknowns, (rows, quantities, P)."""
        with in_precision(_PRECISION):
            return np.asarray(self._slopes(jnp.asarray(z)))

    def thrust(self, z: np.ndarray, volts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Settled thrust at voltages, N, (rows,), and its derivatives, (rows, P)."""
        with in_precision(_PRECISION):
            arguments = (jnp.asarray(z), jnp.asarray(volts))
            return np.asarray(self._thrust(*arguments)), np.asarray(self._thrust_slopes(*arguments))

    def values(self, z: np.ndarray) -> dict[str, float]:
        """Parameters by name."""
        return {parameter.name: float(parameter.value(z[i])) for i, parameter in enumerate(self.parameters)}

    def predicted(self, z: np.ndarray, table: BenchTable) -> BenchResponse:
        """What the thruster does with the commands of a record."""
        with in_precision(_PRECISION):
            return self._response(_traced_values(self.parameters, jnp.asarray(z)), table)

    def _error_of(self, z):
        values = _traced_values(self.parameters, z)
        predicted = []
        for table in self.tables:
            response = self._response(values, table)
            current = self.form.motor_current(values, response, jnp.asarray(table.thrust))
            response = response._replace(current=current * jnp.asarray(table.duty))
            predicted.append(jnp.stack([getattr(response, name) for name in self.form.measured], axis=1))
        return jnp.where(self.present, jnp.concatenate(predicted) - self._measured, 0.0)

    def _response(self, values, table: BenchTable) -> BenchResponse:
        volts = jnp.asarray(table.volts)
        if table.time is None:
            return self.form.settled(values, volts)
        begin = self.form.begin(values, volts[:1])
        command = held_command(table.volts, table.time)
        return response_over_time(self.form.part(values), begin, command, values["delay"])

    def _thrust_of(self, z, volts):
        return self.form.settled(_traced_values(self.parameters, z), volts).thrust


def _traced_values(parameters: Sequence[FreeParameter], z) -> dict[str, jax.Array]:
    """Parameters by name, as `FreeParameter.value` has them, of numbers that may be traced."""
    return {
        p.name: p.prior * jnp.exp(p.deviation * z[i]) if p.is_ratio else p.prior + p.deviation * z[i]
        for i, p in enumerate(parameters)
    }


def _rounding(values: np.ndarray) -> float:
    """Standard deviation of the rounding of printed numbers: that of an even spread over their last digit."""
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0.0:
        return 1.0
    gaps = np.diff(np.unique(np.round(np.abs(values) / (_FINEST * largest))))
    digit = float(gaps.min(initial=np.inf)) * _FINEST * largest
    return max(_LEAST_NOISE * largest, digit / np.sqrt(12) if np.isfinite(digit) else 0.0)
