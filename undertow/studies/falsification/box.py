"""The box of what varies: coordinates of a departure from the nominal scenario, relative to the stated bounds."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from undertow.core.errors import BadInput
from undertow.scenario.build import Built
from undertow.scenario.reading import Text, key_path
from undertow.scenario.schema import Bounds
from undertow.studies.campaign.varied_scenario import varied_scenario

# Sections of a scenario whose numbers can vary; the others are settings of the run and what is required of it.
_SECTIONS = (
    "plant",
    "model",
    "controller",
    "reference",
    "disturbance",
    "navigation",
    "supervisor",
    "faults",
    "initial",
)


class SearchDimension(NamedTuple):
    """One number that varies.

    Attributes:
        key: its key path in the scenario.
        low, nominal, high: its bounds and its value in the nominal scenario, in its own unit.
        integer: whether it is a whole number.
    """

    key: str
    low: float
    nominal: float
    high: float
    integer: bool

    def value(self, departure: Any, numbers: Any = np) -> Any:
        """The number for a departure: -1 at the lower bound, 0 at the nominal value, 1 at the upper bound."""
        reach = numbers.where(departure < 0, self.nominal - self.low, self.high - self.nominal)
        return self.nominal + departure * reach


class Box(NamedTuple):
    """Departures from the nominal scenario: one coordinate per number that varies, 0 at its nominal value."""

    axes: tuple[SearchDimension, ...]

    @property
    def lower(self) -> Float[np.ndarray, " k"]:
        """Smallest coordinates: -1, or 0 where the nominal value is the lower bound."""
        return np.array([-1.0 if axis.low < axis.nominal else 0.0 for axis in self.axes])

    @property
    def upper(self) -> Float[np.ndarray, " k"]:
        """Largest coordinates."""
        return np.array([1.0 if axis.high > axis.nominal else 0.0 for axis in self.axes])

    def of_cube(self, points: Float[np.ndarray, "p k"]) -> Float[np.ndarray, "p k"]:
        """Departures of points of the unit cube, uniform in the numbers themselves."""
        columns = []
        for axis, share in zip(self.axes, np.asarray(points).T, strict=True):
            offset = axis.low + share * (axis.high - axis.low) - axis.nominal
            room_below, room_above = axis.nominal - axis.low, axis.high - axis.nominal
            columns.append(np.where(offset < 0, offset / (room_below or 1.0), offset / (room_above or 1.0)))
        return np.stack(columns, axis=-1)

    def to_cube(self, departures: Float[np.ndarray, "p k"]) -> Float[np.ndarray, "p k"]:
        """Points of the unit cube of departures."""
        columns = zip(self.axes, np.asarray(departures).T, strict=True)
        return np.stack([(axis.value(d) - axis.low) / (axis.high - axis.low) for axis, d in columns], axis=-1)

    def values(self, departure: Float[np.ndarray, " k"]) -> dict[str, float | int]:
        """Numbers of a departure by key path; clipped, so that rounding leads to no value outside the bounds."""
        numbers: dict[str, float | int] = {}
        for axis, away in zip(self.axes, departure.tolist(), strict=True):
            value = min(max(float(axis.value(away)), axis.low), axis.high)
            numbers[axis.key] = round(value) if axis.integer else value
        return numbers

    def size(self, departures: Float[np.ndarray, "... k"]) -> Float[np.ndarray, "..."]:
        """Euclidean norm of departures: 1 is one number at its bound."""
        return np.sqrt((np.asarray(departures) ** 2).sum(-1))


def box_of(vary: Mapping[str, Bounds], built: Built) -> Box:
    """The box of a scenario.

    Args:
        vary: bounds by key path.
        built: the nominal scenario, whose numbers are the nominal values.

    Raises:
        BadInput: nothing varies; a nominal value is not known, or not within its bounds.
    """
    if not vary:
        hint = "For example `falsify: {vary: {disturbance.amplitude: {between: [0, 2]}}}`"
        raise BadInput("falsify.vary", "name what varies", "empty", hint=hint)
    return Box(tuple(_axis(key, bounds, built) for key, bounds in vary.items()))


def _axis(key: str, bounds: Bounds, built: Built) -> SearchDimension:
    low, high = bounds.between
    nominal = bounds.nominal
    name = f"falsify.vary.{key}"
    section = next(iter(key_path(key)), "")
    if section not in _SECTIONS:
        got = f"`{section}`" if section else "empty"
        raise BadInput(name, f"be the key path of a number in {', '.join(_SECTIONS)}", got)
    if nominal is None:
        nominal = _number_at(built.resolved, key_path(key))
    if nominal is None:
        hint = f"Write it in the scenario, or as `{{between: [{low:g}, {high:g}], nominal: {low:g}}}`"
        raise BadInput(name, "have a number for its nominal value", "none in the scenario", hint=hint)
    if not low <= nominal <= high:
        hint = "The bounds have to include the value of the scenario"
        raise BadInput(name, f"be around the nominal value {nominal:g}", f"{low:g} to {high:g}", hint=hint)
    return SearchDimension(key, low, float(nominal), high, bounds.integer)


def _number_at(node: Any, path: Sequence[str | int]) -> float | None:
    """The number at a key path; None where there is none."""
    for step in path:
        try:
            node = node[step]
        except (KeyError, IndexError, TypeError):
            return None
    return float(node) if isinstance(node, int | float) and not isinstance(node, bool) else None


def scenario_at(text: Text, values: Mapping[str, Any]) -> Text:
    """The scenario with other numbers at some key paths; the nominal model keeps those of the scenario.

    Raises:
        BadInput: a key path leads to nothing of the scenario.
    """
    return text._replace(data=varied_scenario(text.data, values))
