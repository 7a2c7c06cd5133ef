"""Pareto fronts of a comparison: medians of an error against medians of an effort."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

ERRORS = ("position_rms", "attitude_rms")
OTHERWISE = ("tracking_rms",)  # for a plant without both
EFFORTS = ("input_rms", "input_variation")


class Front(NamedTuple):
    """One error against one effort.

    Attributes:
        error, effort: names of the metrics.
        points: candidate -> median error and median effort; without candidates that lack one of them.
        front: candidates of which no other one has both a smaller or equal error and a smaller or equal effort, one of
            them smaller, by increasing error.
        incomplete: candidates that did not complete every trial: their medians leave out the trials in which they
            failed, so that they neither are on the front nor dominate.
    """

    error: str
    effort: str
    points: dict[str, tuple[float, float]]
    front: tuple[str, ...]
    incomplete: tuple[str, ...]

    def data(self) -> dict[str, Any]:
        """The same as numbers, words and lists."""
        return self._asdict() | {"points": {name: list(point) for name, point in self.points.items()}}


def on_front(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Which points no other point dominates, for two numbers of which less is better; equal points are all kept."""
    costs = np.asarray(points, dtype=float).reshape(-1, 2)
    # Of every pair: the first axis is the point that may dominate, the second the one that may be dominated.
    no_worse = (costs[:, None] <= costs[None]).all(-1)
    better = (costs[:, None] < costs[None]).any(-1)
    dominated = np.logical_or.reduce(no_worse & better, axis=0)
    return [not is_dominated for is_dominated in dominated]


def fronts(medians: Mapping[str, Mapping[str, float]], complete: Mapping[str, bool]) -> tuple[Front, ...]:
    """Every front for which the metrics are known and differ.

    Args:
        medians: metric -> candidate -> median; NaN or infinite where there is none.
        complete: candidate -> whether it completed every trial.
    """
    errors = [name for name in ERRORS if name in medians] or [name for name in OTHERWISE if name in medians]
    pairs = [(error, effort) for error in errors for effort in EFFORTS if effort in medians]
    candidates = [_front(error, effort, medians, complete) for error, effort in pairs]
    return tuple(front for front in candidates if len(set(front.points.values())) > 1)


def _front(error: str, effort: str, medians: Mapping[str, Mapping[str, float]], complete: Mapping[str, bool]) -> Front:
    pairs = {name: (medians[error][name], medians[effort][name]) for name in complete}
    points = {name: point for name, point in pairs.items() if all(map(math.isfinite, point))}
    judged = [name for name in points if complete[name]]
    flags = on_front([points[name] for name in judged])
    non_dominated = [name for name, is_on_front in zip(judged, flags, strict=True) if is_on_front]
    ordered = tuple(sorted(non_dominated, key=lambda name: points[name]))
    return Front(error, effort, points, ordered, tuple(name for name in points if not complete[name]))
