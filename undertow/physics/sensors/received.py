"""What a filter receives of the readings of sensors, and how faults change that."""

import abc
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
from jaxtyping import Array, Bool, PRNGKeyArray, PyTree

from undertow.core.numerics.number import Number
from undertow.physics.sensors.sampling import Reading


class Received(NamedTuple):
    """What one sensor has delivered."""

    reading: Reading
    fresh: Bool[Array, ""]  # whether it is new
    age: Number  # s, since it was taken


class AbstractSensorFaults(eqx.Module):
    """Faults of sensors: what a filter receives instead of what they deliver."""

    @abc.abstractmethod
    def init(self, readings: Sequence[Reading]) -> PyTree:
        """State before the first step, for readings of these shapes."""

    @abc.abstractmethod
    def received(
        self, key: PRNGKeyArray, state: PyTree, t: Number, received: tuple[Received, ...]
    ) -> tuple[tuple[Received, ...], PyTree]:
        """What reaches the filter at time t (s), and the state afterwards; `key` is that of the run."""
