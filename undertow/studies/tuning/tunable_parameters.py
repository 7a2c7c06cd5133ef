"""Tunable parameters: options of a controller, each between two bounds on a logarithmic scale."""

import re
from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.contracts import AbstractController
from undertow.core.errors import BadInput
from undertow.core.param import tuning_ranges

Point = Float[Array, " k"]  # 0 at the lower bound of a parameter, 1 at the upper

_NAME = re.compile(r"(\w+)(?:\[(\d+)\])?")
_WIDTHS = {"feedback": 2, "gains": 3}  # options with several numbers per axis, and their count


class TunableParameter(NamedTuple):
    """One tunable number, shared by a group of axes."""

    option: str
    entry: int | None  # index, for an option with several numbers per axis, such as `feedback[0]`
    axes: tuple[int, ...]  # () for an option with one number for all axes
    low: float
    high: float

    @property
    def name(self) -> str:
        """Name as in a scenario, with its axes."""
        entry = "" if self.entry is None else f"[{self.entry}]"
        return f"{self.option}{entry}" + (f" of axes {', '.join(str(a + 1) for a in self.axes)}" if self.axes else "")

    def value(self, share: Any) -> Any:
        """Value on a logarithmic scale: low at 0, high at 1."""
        return self.low * (self.high / self.low) ** share

    def share(self, value: float) -> float:
        """Share of a value between the bounds; a value outside is moved to the nearest bound."""
        inside = min(max(value, self.low), self.high)
        return float(np.log(inside / self.low) / np.log(self.high / self.low))


def parameters(
    ranges: Mapping[str, Sequence[float]], groups: Sequence[tuple[int, ...]], shared: Sequence[str] = ()
) -> list[TunableParameter]:
    """A parameter per option and group of axes; one for an option that all axes share.

    Args:
        ranges: low and high by option; `feedback[0]` for the first of several numbers per axis.
        groups: groups of axes that share their gains.
        shared: options with one number for all axes.

    Raises:
        BadInput: not two bounds, not positive, or the wrong way round; or not all numbers of an option.
    """
    tunable = []
    for name, bounds in ranges.items():
        option, entry = _parsed(name)
        low, high = _bounds(name, bounds)
        for axes in [()] if option in shared else groups:
            tunable.append(TunableParameter(option, entry, axes, low, high))
    for option, width in _WIDTHS.items():
        entries = [parameter.entry for parameter in tunable if parameter.option == option]
        missing = [f"{option}[{i}]" for i in range(width) if i not in entries] if entries else []
        if missing:
            raise BadInput(
                "tune.parameters", f"include {', '.join(missing)}", f"given with {option}[{min(entries)}] only"
            )
    return tunable


def options(chosen: Sequence[TunableParameter], point: Point, axes: int) -> dict[str, Array]:
    """Options at a point; may be traced.

    Args:
        chosen: the parameters, in the order of the point's entries.
        point: shape (k,).
        axes: n.
    """
    values: dict[str, Any] = {}
    for share, parameter in zip(point, chosen, strict=True):
        value = parameter.value(share)
        if not parameter.axes:
            values[parameter.option] = value
            continue
        shape = (axes,) if parameter.entry is None else (axes, _WIDTHS[parameter.option])
        held = values.get(parameter.option, jnp.zeros(shape))
        index = (np.array(parameter.axes),) if parameter.entry is None else (np.array(parameter.axes), parameter.entry)
        values[parameter.option] = held.at[index].set(value)
    return values


def _parsed(name: str) -> tuple[str, int | None]:
    match = _NAME.fullmatch(name)
    option, entry = match.groups() if match else (name, None)
    width = _WIDTHS.get(option, 0)
    if width == 0 and entry is not None:
        raise BadInput(f"tune.parameters.{name}", f"be `{option}`, which is one number per axis")
    if width and (entry is None or int(entry) >= width):
        raise BadInput(f"tune.parameters.{name}", f"be one of {', '.join(f'{option}[{i}]' for i in range(width))}")
    return option, None if entry is None else int(entry)


def _bounds(name: str, bounds: Sequence[float]) -> tuple[float, float]:
    key = f"tune.parameters.{name}"
    if len(bounds) != 2:
        raise BadInput(key, "be [low, high]", list(bounds))
    low, high = bounds
    if not 0 < low:
        raise BadInput(key, "have a positive lower bound, for a logarithmic scale", low)
    if not low < high:
        raise BadInput(key, "be [low, high] with low < high", list(bounds))
    return float(low), float(high)


Range = tuple[float, float]


class TunableParameters(NamedTuple):
    """Tunable parameters of one controller."""

    ranges: Callable[[float], Mapping[str, Range]]  # for a sampling time, s
    now: Mapping[str, Callable[[Any], Any]]  # value of an option in an existing controller
    instead: Mapping[str, tuple[str, ...]]  # option -> equivalent options that must be left out


# Options with one number for all axes.
SHARED = ("actuator_rate", "adaptation_rate", "direction")


def _robust(dt: float) -> Mapping[str, Range]:
    return {
        "bandwidth": (0.3, 0.5 / dt),
        "damping": (0.5, 3.0),
        "tracking": (0.1, 0.25 / dt),
        "actuator_rate": (1.0, 0.5 / dt),
    }


def _paper(dt: float) -> Mapping[str, Range]:
    return {
        "feedback[0]": (0.05, 100.0),
        "feedback[1]": (0.2, 40.0),
        "pole": (0.5, min(150.0, 0.8 / dt)),
        "adaptation": (1e-3, 100.0),
        "composite": (5.0, 1000.0),
        "robust_gain": (1e-3, 10.0),
    }


def _pid(dt: float) -> Mapping[str, Range]:
    return {"frequency": (0.1, 0.25 / dt), "damping": (0.3, 4.0), "integral_share": (0.01, 1.0)}


def _observed(dt: float) -> Mapping[str, Range]:
    return {"bandwidth": (0.3, 0.5 / dt), "damping": (0.5, 3.0), "tracking": (0.1, 0.25 / dt)}


_OBSERVED = TunableParameters(
    ranges=_observed,
    now={
        "bandwidth": lambda law: law.bandwidth,
        "damping": lambda law: law.damping,
        "tracking": lambda law: jnp.sqrt(law.feedback[..., 0]),
    },
    instead={"tracking": ("feedback",)},
)

_ROBUST = TunableParameters(
    ranges=_robust,
    now={
        "bandwidth": lambda law: law.estimator.bandwidth,
        "damping": lambda law: law.estimator.damping,
        "tracking": lambda law: jnp.sqrt(law.feedback[..., 0]),
        "actuator_rate": lambda law: law.actuator_rate,
    },
    instead={"tracking": ("feedback",), "bandwidth": ("pole", "adaptation", "composite")},
)

_LAWS = {
    ("adrc", None): _OBSERVED,
    ("indi", None): _OBSERVED,
    ("rcaf", "robust"): _ROBUST,
    ("rcaf", "learning"): _ROBUST._replace(instead={"tracking": ("feedback",)}),
    ("rcaf", "paper"): TunableParameters(
        ranges=_paper,
        now={
            "feedback[0]": lambda law: law.feedback[..., 0],
            "feedback[1]": lambda law: law.feedback[..., 1],
            "pole": lambda law: law.identification.pole,
            "adaptation": lambda law: law.adaptation,
            "composite": lambda law: law.composite,
            "robust_gain": lambda law: law.robust_gain,
        },
        instead={},
    ),
    ("pid", None): TunableParameters(
        ranges=_pid,
        now={
            "frequency": lambda law: jnp.sqrt(law.proportional),
            "damping": lambda law: law.derivative / (2 * jnp.sqrt(law.proportional)),
            "integral_share": lambda law: law.integral / law.proportional**1.5,
        },
        instead={"frequency": ("gains",)},
    ),
}


def law_of(kind: str, preset: str | None, law: AbstractController) -> TunableParameters:
    """Tunable parameters of a controller: the known ones, else the parameters that declare a `range`."""
    declared = tuning_ranges(law)
    declared_only = TunableParameters(lambda dt: declared, {name: attrgetter(name) for name in declared}, {})
    return _LAWS.get((kind, preset), declared_only)
