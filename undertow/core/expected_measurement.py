"""Readings that are not finite: the law gets expected values in their place."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Int

from undertow.core.contracts import AbstractController, AbstractCoordinates, Inputs, Measurement, Outputs, Time
from undertow.core.measurement import with_outputs


def is_finite(numbers: Array) -> Bool[Array, "..."]:
    """Which numbers have a finite square, which laws and metrics need."""
    if not jnp.issubdtype(numbers.dtype, jnp.floating):
        return jnp.isfinite(numbers)
    return jnp.abs(numbers) < jnp.sqrt(jnp.finfo(numbers.dtype).max)


def all_finite(tree: Any) -> Bool[Array, ""]:
    """Whether all numbers of a tree pass `is_finite`."""
    return jnp.stack([is_finite(leaf).all() for leaf in jax.tree.leaves(tree)]).all()


class Expected(NamedTuple):
    """Expected next measurement, by the law's own model: x_ddot = F + G u + d_hat.

    A law that gets this in place of a reading does not adapt to it: its identification model follows the same
    equation, so that its error stays that of the last reading.
    """

    position: Outputs  # m, rad
    rates: Outputs  # in the coordinates of the model, m/s, rad/s
    actuator: Any  # as reported last
    replaced: Int[Array, ""]  # readings so far with a replaced entry

    def repaired(self, coordinates: AbstractCoordinates, y: Measurement) -> tuple[Measurement, "Expected"]:
        """Measurement with expected values in place of entries that are not finite, and the state with the count."""
        finite_or_expected = lambda read, expected: jnp.where(is_finite(read), read, expected)
        actuator = jax.tree.map(finite_or_expected, y.actuator, self.actuator)

        def repaired():
            still = coordinates.measurement(self.position, jnp.zeros_like(self.position))
            velocity = coordinates.output_velocity(still, self.rates)
            outputs = finite_or_expected(y.position, self.position), finite_or_expected(y.velocity, velocity)
            return with_outputs(y, *outputs)._replace(actuator=actuator)

        finite = all_finite((y.position, y.velocity))
        measurement = jax.lax.cond(finite, lambda: y._replace(actuator=actuator), repaired)
        return measurement, self._replace(replaced=self.replaced + jnp.where(all_finite(y), 0, 1))

    def after(
        self, law: AbstractController, z: Any, y: Measurement, estimate: Outputs | None, applied: Inputs, dt: Time
    ) -> "Expected":
        """One sampling time later, with an input applied; `estimate` is d_hat of a law that has one."""
        modelled = law.known_acceleration(z, y, applied)
        acceleration = modelled if estimate is None else modelled + estimate
        rates = law.model.coordinates.velocity(y) + dt * acceleration
        return Expected(y.position + dt * y.velocity, rates, y.actuator, self.replaced)


def at_start(coordinates: AbstractCoordinates, truth: Measurement, y: Measurement) -> Expected:
    """Expected value of the first reading `y`: the true state, and actuators at rest unless reported."""
    actuator = jax.tree.map(lambda read: jnp.where(is_finite(read), read, jnp.zeros_like(read)), y.actuator)
    return Expected(truth.position, coordinates.velocity(truth), actuator, jnp.zeros((), dtype=int))
