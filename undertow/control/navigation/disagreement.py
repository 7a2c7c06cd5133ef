"""What a filter does when its aids, the sensors other than gyroscopes and accelerometers, contradict its estimate."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from undertow.control.navigation.inertial_covariance import ATTITUDE, FORCE_BIAS, GYRO_BIAS, POSITION, VELOCITY
from undertow.control.navigation.sensor_errors import Covariance
from undertow.core.numerics.number import Number

PerSensor = Float[Array, " sensors"]

_MOST_TOLERATED = 2.0**20  # a lasting jump of 1000 gates is believed, nothing beyond
_DOUBLING = 0.2  # s of rejections in which the tolerated square doubles; a slower sensor doubles it by each of them
_VOTING = 3.0  # periods, at least as many s, after which the last reading of a sensor counts no more
_FOREVER = 1e6  # s
_FEWEST = 2  # aids that outvote the filter
_LEAST_VARIANCE = 1e-30  # in the square of any of the units below
_UNKNOWN = (
    (ATTITUDE, 1.0),
    (VELOCITY, 10.0),
    (POSITION, 1e3),
)  # rad, m/s, m: largest deviations of an estimate that is lost


class Disagreement(NamedTuple):
    """Rejections in a row of each sensor, and how often all gates were opened."""

    tolerance: PerSensor  # factor of the gate's square
    excess: PerSensor  # normalised square of an entry of the last reading, if it was rejected; else zero
    silent: PerSensor  # s since the last reading
    reopened: Int[Array, ""]  # times so far that most aids were right against the filter

    def later(self, elapsed: Number) -> "Disagreement":
        """The same `elapsed` (s) later, without a reading."""
        return self._replace(silent=self.silent + elapsed)

    def after(
        self, sensor: int, accepted: Bool[Array, ""], delivered: Bool[Array, ""], square: Number, period: Number
    ) -> "Disagreement":
        """With a reading of a sensor.

        Args:
            sensor: its place.
            accepted: whether the filter took it.
            delivered: whether there is one.
            square: normalised square of an entry.
            period: between readings, s.
        """
        tolerance, excess = self.tolerance[sensor], self.excess[sensor]
        step = 2 ** jnp.minimum(period / _DOUBLING, 1.0)
        # What is taken lowers it as slowly: where a wrong reading was believed, the right ones soon are.
        lowered, raised = jnp.maximum(tolerance / step, 1.0), jnp.minimum(tolerance * step, _MOST_TOLERATED)
        adjusted = jnp.where(accepted, lowered, raised)
        new_tolerance = jnp.where(delivered, adjusted, tolerance)
        # A square that is no number any more counts as the largest.
        limited = jnp.where(square < _MOST_TOLERATED, square, _MOST_TOLERATED)
        new_excess = jnp.where(delivered, jnp.where(accepted, 0.0, limited), excess)
        return self._replace(
            tolerance=self.tolerance.at[sensor].set(new_tolerance),
            excess=self.excess.at[sensor].set(new_excess),
            silent=self.silent.at[sensor].set(jnp.where(delivered, 0.0, self.silent[sensor])),
        )

    def reopening(
        self, periods: PerSensor, covariance: Covariance, initial: Float[Array, "15"]
    ) -> tuple["Disagreement", Covariance]:
        """Where most aids were rejected at last, it is the filter that errs: its covariance grows until they are taken.

        The covariance of the motion grows by the largest of their normalised squares, that of the biases to what it was
        at the start.

        Args:
            periods: between readings of each sensor, s.
            covariance: of the filter.
            initial: standard deviations at the start.
        """
        voting = self.silent <= _VOTING * jnp.maximum(periods, 1.0)
        against = voting & (self.excess > 0)
        objections = jnp.where(against, 1.0, 0.0).sum()
        outvoted = (objections >= _FEWEST) & (2 * objections > jnp.where(voting, 1.0, 0.0).sum())
        growth = jnp.sqrt(jnp.maximum(jnp.where(against, self.excess, 0.0).max(), 1.0))
        # No variance is negative, but the rounding errors of enormous ones may be.
        deviation = jnp.sqrt(jnp.maximum(jnp.diagonal(covariance), _LEAST_VARIANCE))
        factor = jnp.ones(len(covariance))
        for part, largest_deviation in _UNKNOWN:
            factor = factor.at[part].set(jnp.clip(largest_deviation / deviation[part], 1.0, growth))
        for part in (GYRO_BIAS, FORCE_BIAS):
            factor = factor.at[part].set(jnp.maximum(initial[part] / deviation[part], 1.0))
        factor = jnp.where(outvoted, factor, 1.0)
        reopened = self._replace(
            tolerance=jnp.where(outvoted, 1.0, self.tolerance),
            excess=jnp.where(outvoted, 0.0, self.excess),
            reopened=self.reopened + jnp.where(outvoted, 1, 0),
        )
        return reopened, covariance * factor[:, None] * factor[None, :]


def no_disagreement(sensors: int) -> Disagreement:
    """That of a filter that has had no reading yet."""
    ones = jnp.ones(sensors)
    return Disagreement(ones, 0 * ones, _FOREVER * ones, jnp.zeros((), dtype=int))


def distrusted(
    covariance: Covariance, slopes: Float[Array, "entries states"], error: Float[Array, " entries"]
) -> Float[Array, " states"]:
    """Variances to be added so that errors of a reading become likely: each falls to the states that it depends on.

    Nothing falls to states that are merely correlated with them: what made the estimate wrong need not be what usually
    does.

    Args:
        covariance: of the filter.
        slopes: of the reading in the errors of the states.
        error: of each entry.
    """
    weights = jnp.diagonal(covariance)[None, :] * slopes
    shares = weights / (weights * slopes).sum(1)[:, None]
    return ((error[:, None] * shares) ** 2).sum(0)
