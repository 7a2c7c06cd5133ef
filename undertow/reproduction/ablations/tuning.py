"""A small fair search: the same few gains for every law, tried on seeds that the report does not use."""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np

from undertow.loop.closed_loop import ClosedLoop
from undertow.reproduction.ablations.ablation import Schedule
from undertow.reproduction.ablations.runner import TRAINING, run

# Tracking error that is worth as much as an input variation: m (rad), and m/s^2 (V) per s.
ERROR, VARIATION = 1e-3, 1e3

COST = f"tracking rms / {1e3 * ERROR:g} mm + variation of the input / {VARIATION:g} per s"

_SEEDS = 4


class Tuned(NamedTuple):
    """The best of a grid."""

    factors: tuple[float, ...]
    loop: ClosedLoop
    cost: float  # median over the training seeds
    tried: int


def tuned(
    make: Callable[..., ClosedLoop], grid: tuple[tuple[float, ...], ...], schedule: Schedule, seeds: int = _SEEDS
) -> Tuned:
    """Every combination of factors on training seeds; the first of the cheapest.

    Args:
        make: closed loop from one factor per entry of `grid`.
        grid: factors to try.
        schedule: as reported later.
        seeds: training seeds.
    """
    points = list(product(*grid))
    costs = [cost(run(make(*point), schedule, seeds, TRAINING)) for point in points]
    best = int(np.argmin(costs))
    return Tuned(points[best], make(*points[best]), costs[best], len(points))


def cost(outcomes) -> float:
    """Median over seeds of what is made small."""
    return float(np.median(outcomes["tracking_rms"] / ERROR + outcomes["input_variation"] / VARIATION))
