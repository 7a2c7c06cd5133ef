"""The contract of a metric: a figure of a run, accumulated step by step."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float, PyTree


class Metric(NamedTuple):
    """What is known of a metric beside its key.

    Attributes:
        unit: with `[input]` for that of the plant's inputs, and `` for none.
        meaning: in a sentence.
        name: in a few words, for tables; the key is shown where there is none.
    """

    unit: str
    meaning: str
    name: str = ""

    def named(self, key: str) -> str:
        """Its name, or its key with spaces."""
        return self.name or key.replace("_", " ")


class AbstractMetric(eqx.Module):
    """One or several figures of a window of a run. A metric of your own is one file: `metrics: ["./mine.py:mine"]`.

    `init` and `update` are compiled with the loop; `update` gets the instants of the window only.
    """

    @abc.abstractmethod
    def metrics(self) -> dict[str, Metric]:
        """Unit and meaning of every figure, by name."""

    @abc.abstractmethod
    def init(self, signals: dict[str, Array]) -> PyTree:
        """State before the first instant; `signals` gives the shapes, see `undertow describe signals`."""

    @abc.abstractmethod
    def update(self, state: PyTree, t: Float[Array, ""], signals: dict[str, Array]) -> PyTree:
        """State after the signals of one more instant, t in s."""

    @abc.abstractmethod
    def values(self, state: Any) -> dict[str, Any]:
        """The figures by name, from the last state as NumPy arrays; NaN for a figure that is undefined in this run."""
