"""Default tunable parameters of each controller, with their ranges."""

from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any, NamedTuple

import jax.numpy as jnp

from undertow.core.contracts import AbstractController
from undertow.core.param import tuning_ranges

Range = tuple[float, float]


class Law(NamedTuple):
    """Tunable parameters of one controller."""

    ranges: Callable[[float], Mapping[str, Range]]  # for a sampling time, s
    now: Mapping[str, Callable[[Any], Any]]  # value of an option in an existing controller
    instead: Mapping[str, tuple[str, ...]]  # option -> equivalent options that must be left out


# Options with one number for all axes.
SHARED = ("actuator_rate", "direction")


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


_LAWS = {
    ("rcaf", "robust"): Law(
        ranges=_robust,
        now={
            "bandwidth": lambda law: law.estimator.bandwidth,
            "damping": lambda law: law.estimator.damping,
            "tracking": lambda law: jnp.sqrt(law.feedback[..., 0]),
            "actuator_rate": lambda law: law.actuator_rate,
        },
        instead={"tracking": ("feedback",), "bandwidth": ("pole", "adaptation", "composite")},
    ),
    ("rcaf", "paper"): Law(
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
    ("pid", None): Law(
        ranges=_pid,
        now={
            "frequency": lambda law: jnp.sqrt(law.proportional),
            "damping": lambda law: law.derivative / (2 * jnp.sqrt(law.proportional)),
            "integral_share": lambda law: law.integral / law.proportional**1.5,
        },
        instead={"frequency": ("gains",)},
    ),
}


def law_of(kind: str, preset: str | None, law: AbstractController) -> Law:
    """Tunable parameters of a controller: the known ones, else the parameters that declare a `range`."""
    declared = tuning_ranges(law)
    own = Law(lambda dt: declared, {name: attrgetter(name) for name in declared}, {})
    return _LAWS.get((kind, preset), own)


def now(known: Law, law: AbstractController, option: str, given: Any) -> Any:
    """Value of an option: from the controller, else the given one; None where neither is known."""
    return known.now[option](law) if option in known.now else given
