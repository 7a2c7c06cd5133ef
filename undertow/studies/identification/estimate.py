"""One of the estimates of an identification, with its progress."""

import time
from collections.abc import Callable, Sequence

import numpy as np

from undertow.studies.identification.dive import Dive
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.model import IdentificationModel, Unknowns
from undertow.studies.identification.output_error import Fit, first_errors, fit
from undertow.studies.identification.segments import segments_of

_SHARES_OF_FIRST = (1.0, 0.5, 0.0)  # of a first estimate, at which an estimate may begin

Say = Callable[[str], None]
Watch = Callable[[int, float], None]


class Stages:
    """Says which of several estimates is under way, and how long the others may take after the first."""

    def __init__(self, say: Say, count: int):
        self._say, self._count, self._number, self._started = say, count, 0, time.perf_counter()

    def next(self, name: str) -> Watch:
        """What is called with the iteration and the cost of the next estimate."""
        done = self._number
        left = ""
        if done:
            seconds = (self._count - done) * (time.perf_counter() - self._started) / done
            left = f", about {seconds:.0f} s left at most"
        self._number += 1
        label = f"estimate {self._number} of {self._count} ({name}){left}"
        return lambda iteration, cost: self._say(f"{label}: iteration {iteration}, cost {cost:.6g}")


def nearest_begin(
    model: IdentificationModel,
    parameters: Sequence[FreeParameter],
    dives: Sequence[Dive],
    segment: float,
    found: np.ndarray,
) -> np.ndarray:
    """Where an estimate begins: at a first estimate, at the numbers of the file, or half-way.

    That one counts which predicts the segments best, large errors counted as equal: a first estimate from velocities
    that were smoothed or hardly measured can be farther off than the file.

    Args:
        model, parameters, dives, segment: as below.
        found: first estimate.
    """
    segments, step = segments_of(dives, segment), dives[0].step
    errors = [
        first_errors(model, segments, step, _unknowns(parameters, dives, share * found)[0])
        for share in _SHARES_OF_FIRST
    ]
    return _SHARES_OF_FIRST[int(np.argmin(errors))] * found


def _unknowns(
    parameters: Sequence[FreeParameter], dives: Sequence[Dive], z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """All unknowns where the parameters have some numbers and nothing else is known, and their smallest numbers."""
    least = Unknowns(tuple(parameters), len(dives)).least()
    unknowns = np.zeros(len(least))
    unknowns[: len(parameters)] = z
    return unknowns, least


def estimate_from(
    model: IdentificationModel,
    parameters: Sequence[FreeParameter],
    dives: Sequence[Dive],
    segment: float,
    begin: np.ndarray,
    watch: Watch,
    noise: np.ndarray | None = None,
) -> Fit:
    """The estimate from some dives.

    Args:
        model: see there.
        parameters: that are free.
        dives: see there.
        segment: length of the segments, s.
        begin: where the parameters begin.
        watch: called with the iteration and the cost.
        noise: see `fit`.
    """
    z, least = _unknowns(parameters, dives, begin)
    return fit(model, segments_of(dives, segment), dives[0].step, z, least, watch, noise)
