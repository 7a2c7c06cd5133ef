"""Errors of a sensor that last: first-order Gauss-Markov processes on its readings.

P. D. Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed. (2013): chapter 3 on
such processes as states of a filter, chapter 6 on errors of compasses and Doppler logs.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.numerics.number import Number
from undertow.core.param import Param, param

ErrorValues = Float[Array, " errors"]


class CorrelatedErrors(eqx.Module):
    """Errors c of x_dot = -x / tau + white noise, of which the reading has a weighted sum: slopes times c.

    Raises:
        BadInput: a deviation negative, a time not positive, or not one time for each deviation.
    """

    deviation: Float[Param, " errors"] = param("of the error", "standard deviation", symbol="sigma")
    correlation_time: Float[Param, " errors"] = param(
        "s", "time in which the correlation falls to 1/e; infinite for a constant", symbol="tau"
    )

    def __check_init__(self):
        checks.not_negative("deviation", self.deviation)
        checks.length("correlation_time", self.correlation_time, len(self.deviation), "one for each error")
        checks.positive("correlation_time", self.correlation_time, "s", finite=False)

    def kept(self, elapsed: Number) -> ErrorValues:
        """Share of each error that is left `elapsed` (s) later."""
        return jnp.exp(-elapsed / self.correlation_time)

    def gained(self, elapsed: Number) -> ErrorValues:
        """Variance that each error gains in `elapsed` (s), so that its deviation stays."""
        return -jnp.expm1(-2 * elapsed / self.correlation_time) * self.deviation**2

    def start(self, chance: ErrorValues) -> ErrorValues:
        """Errors at the start, of standard normal numbers."""
        return self.deviation * chance

    def after(self, errors: ErrorValues, elapsed: Number, chance: ErrorValues) -> ErrorValues:
        """Errors `elapsed` (s) later: exact, whatever the step."""
        return self.kept(elapsed) * errors + jnp.sqrt(self.gained(elapsed)) * chance


class Disturbed(NamedTuple):
    """What correlated errors do to one sample."""

    slopes: Float[Array, "width errors"]  # of the reading in the errors
    chance: ErrorValues  # standard normal numbers of the sample


def correlated_errors(
    correlated_noise: Any, correlation_time: Any, entries: int = 1, name: str = "correlated_noise"
) -> CorrelatedErrors | None:
    """The same error on each of the first entries of a reading, independent of each other; None where there is none.

    Args:
        correlated_noise: standard deviation, in the unit of the reading; None for no error.
        correlation_time: s; None only without an error.
        entries: how many.
        name: of the option that is `correlated_noise`.

    Raises:
        BadInput: one is given without the other.
    """
    if correlated_noise is None and correlation_time is None:
        return None
    if correlated_noise is None or correlation_time is None:
        both = {name: correlated_noise, "correlation_time": correlation_time}
        missing = next(option for option, value in both.items() if value is None)
        there = next(option for option, value in both.items() if value is not None)
        raise BadInput(missing, f"be given with `{there}`", "missing")
    return CorrelatedErrors([correlated_noise] * entries, [correlation_time] * entries)
