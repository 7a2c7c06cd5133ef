"""Random faults of any kind, as entries of the key `faults` of a scenario; made before a run, not within it."""

import math
from typing import Any

import numpy as np

from undertow.core.contracts import AbstractNavigation, AbstractPlant
from undertow.physics.faults.kinds import FaultKind, list_kinds
from undertow.physics.faults.targets import targets_of

# Severities are sampled from this part of the default to this multiple of it, within their range.
_LEAST, _MOST = 0.3, 3.0


def random_faults(
    rng: np.random.Generator, plant: AbstractPlant, navigation: AbstractNavigation, duration: float, number: int = 1
) -> list[dict[str, Any]]:
    """Entries of random faults of a closed loop: every kind is equally likely, and so is every thruster.

    Args:
        rng: source of the randomness.
        plant, navigation: of the loop, without faults.
        duration: of the run, s.
        number: how many.

    Returns:
        Entries of the key `faults`, plain data. Onsets are uniform in the first 80 % of the run. Half of the faults
        last to the end. Severities are log-uniform about their default. A third of the faults of thrusters and bus is
        announced.
    """
    targets = targets_of(plant, navigation)
    every = list_kinds(targets.values())
    chosen = [every[int(place)] for place in rng.integers(len(every), size=number)]
    return [random_fault(rng, kind, targets[kind.target].width, duration) for kind in chosen]


def random_fault(rng: np.random.Generator, kind: FaultKind, width: int, duration: float) -> dict[str, Any]:
    """Entry of a random fault of one kind; `width` is the number of thrusters. As of `random_faults`."""
    thruster = kind.target in ("thruster", "input")
    target = f"{kind.target} {rng.integers(1, width + 1)}" if thruster else kind.target
    entry: dict[str, Any] = {"target": target, "mode": kind.mode}
    if kind.default is not None and kind.lowest is not None and kind.highest is not None:
        factor = math.exp(rng.uniform(math.log(_LEAST), math.log(_MOST)))
        entry["severity"] = _short(min(max(factor * kind.default, kind.lowest), kind.highest))
    entry["onset"] = _short(rng.uniform(0.0, 0.8 * duration))
    if rng.uniform() < 0.5:
        entry["duration"] = _short(rng.uniform(0.02, 0.5) * duration)
    if kind.can_be_announced and rng.uniform() < 1 / 3:
        entry["announced"] = True
    return entry


def _short(number: float) -> float:
    """Four digits, which a person can read and which a file gives back."""
    return float(f"{number:.4g}")
