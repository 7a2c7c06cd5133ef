"""Whether the errors of a filter are as large as it says.

Y. Bar-Shalom, X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation (2001), section 5.4:
normalised errors squared of the estimate (NEES), which a simulation knows, and of the innovations (NIS).
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from undertow.core.numerics.linear_algebra import safe_sqrt, solve_symmetric
from undertow.core.numerics.number import Number

_WINDOW = 30.0  # s over which innovations are averaged
_FEWEST = 20.0  # readings, before which nothing is said
# An rms of innovations and a correlation between readings that errors of a model explain, and standard deviations of a
# mean beyond them that chance does not. Runs whose filter knows all errors stay below, see tests/loop.
_RMS, _CORRELATION, _SURE = 1.1, 0.1, 5.0

PerSensor = Float[Array, " sensors"]


class InnovationConsistency(NamedTuple):
    """Innovations of each sensor, divided by their standard deviations: independent of each other and of variance 1.

    An error that the filter does not know makes them larger, or alike from one reading to the next. Means are over all
    readings at first, then over a window of 30 s with fading memory. Readings that are rejected count as at the gate.
    """

    last: tuple[Array, ...]  # innovation of the last reading of each sensor
    readings: PerSensor  # number of them
    squares: PerSensor  # mean square of an entry
    products: PerSensor  # mean product with the reading before

    def updated(self, sensor: int, innovation: Array, entries: Number, new: Bool[Array, ""], period: Number):
        """With the innovation of a reading, where it is new.

        Args:
            sensor: its place.
            innovation: divided by its standard deviation; zero for entries that were not measured.
            entries: how many were.
            new: whether there is one.
            period: between readings, s.
        """
        count = self.readings[sensor] + jnp.where(new, 1.0, 0.0)
        weight = jnp.where(new, 1.0, 0.0) / jnp.clip(count, 1.0, jnp.maximum(_WINDOW / period, 1.0))
        share = weight / jnp.maximum(entries, 1.0)
        square, product = (innovation * innovation).sum(), (innovation * self.last[sensor]).sum()
        changed = lambda means, value: means.at[sensor].add(share * value - weight * means[sensor])
        last = list(self.last)
        last[sensor] = jnp.where(new, innovation, last[sensor])
        return InnovationConsistency(
            tuple(last),
            self.readings.at[sensor].set(count),
            changed(self.squares, square),
            changed(self.products, product),
        )

    def rms(self) -> PerSensor:
        """Root mean square of the innovations; 1 is as the filter assumes."""
        return safe_sqrt(self.squares)

    def correlation(self) -> PerSensor:
        """Correlation between a reading and the next; 0 is as the filter assumes."""
        return self.products / jnp.where(self.squares > 0, self.squares, 1.0)

    def inconsistent(self, periods: PerSensor) -> PerSensor:
        """1 for a sensor whose innovations are larger or more correlated than chance makes them, else 0."""
        entries = np.array([len(innovations) for innovations in self.last], dtype=float)
        independent = jnp.maximum(jnp.minimum(self.readings, _WINDOW / periods), 1.0) * entries
        larger = self.squares > _RMS**2 * (1 + _SURE * jnp.sqrt(2 / independent))
        alike = self.correlation() > _CORRELATION + _SURE / jnp.sqrt(independent)
        return jnp.where((larger | alike) & (self.readings >= _FEWEST), 1.0, 0.0)


def innovation_monitor(widths: Sequence[int]) -> InnovationConsistency:
    """The monitor before the first reading.

    Args:
        widths: entries of a reading of each sensor that a filter compares.
    """
    none = jnp.zeros(len(widths))
    return InnovationConsistency(tuple(jnp.zeros(width) for width in widths), none, none, none)


def normalised_square(errors: Float[Array, " n"], covariance: Float[Array, "n n"]) -> Float[Array, ""]:
    """e' P^-1 e, whose mean is n where P is the covariance of the errors e."""
    scale = jnp.sqrt(jnp.diagonal(covariance))  # units that differ would cost digits
    unit = errors / scale
    return (unit * solve_symmetric(covariance / scale[:, None] / scale[None, :], unit)).sum()
