"""The estimates of an identification, with their progress and their checkpoint."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from undertow.simulation.checkpoint import Checkpoint
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.fit import Fit, Solution, completed
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.kalman_gains import Disturbance
from undertow.studies.identification.model import IdentificationModel, Unknowns
from undertow.studies.identification.output_error import first_errors, fit
from undertow.studies.identification.prediction_error import filter_fit
from undertow.studies.identification.segments import Segments, segments_of
from undertow.studies.identification.weak_form import first_estimate

_SHARES_OF_FIRST = (1.0, 0.5, 0.0)  # of a first estimate, at which an estimate may begin

METHODS = ("output_error", "prediction_error")

Say = Callable[[str], None]
Watch = Callable[[int, float], None]  # called with the iteration and the cost


class Estimates:
    """The estimates of an identification, one after the other, each from the checkpoint where that has it.

    Args:
        model: see there.
        parameters: that are free.
        segment: length of the segments, s.
        method: one of `METHODS`.
        count: of the estimates.
        say: called with the estimate that is under way, and how long the others may take.
        checkpoint: keeps finished estimates; None to keep none.
    """

    def __init__(
        self,
        model: IdentificationModel,
        parameters: Sequence[FreeParameter],
        segment: float,
        method: str,
        count: int,
        say: Say,
        checkpoint: Checkpoint | None = None,
    ):
        self._model, self._parameters, self._segment = model, parameters, segment
        self._method = method
        self._count, self._say, self._checkpoint = count, say, checkpoint
        self._done, self._started = 0, time.perf_counter()

    def nearest_begin(self, dives: Sequence[Dive]) -> np.ndarray:
        """Where an estimate from some dives begins: at a first estimate, at the numbers of the file, or half-way.

        That one counts which predicts the segments best, large errors counted as equal: a first estimate from
        velocities that were smoothed or hardly measured can be farther off than the file.
        """
        found = first_estimate(self._model.prior, self._parameters, dives).z
        segments, step = segments_of(dives, self._segment), dives[0].step
        errors = [
            first_errors(self._model, segments, step, self._unknowns(dives, share * found)[0])
            for share in _SHARES_OF_FIRST
        ]
        return _SHARES_OF_FIRST[int(np.argmin(errors))] * found

    def of(self, name: str, dives: Sequence[Dive], begin: np.ndarray, near: Fit | None = None) -> Fit:
        """The estimate from some dives.

        Args:
            name: of the estimate, for people.
            dives: see there.
            begin: where the parameters begin.
            near: an estimate from nearly the same, at which this one begins.
        """
        segments, step = segments_of(dives, self._segment), dives[0].step
        z, least = self._unknowns(dives, begin)
        watch = self._watch(name)
        new: list[Fit] = []

        def compute() -> dict[str, Any]:
            new.append(self._found(segments, step, z, least, near, watch))
            return _packed(new[0])

        answer = compute() if self._checkpoint is None else self._checkpoint.ask("estimate", z, compute)
        self._done += 1
        return new[0] if new else completed(self._model, segments, step, _unpacked(answer))

    def _found(self, segments: Segments, step: float, z, least, near: Fit | None, watch: Watch) -> Fit:
        """By the method: a filter begins at an estimate by output error."""
        if self._method == "output_error":
            return fit(self._model, segments, step, z, least, watch, None if near is None else near.noise)
        if near is None or near.disturbance is None:
            first = fit(self._model, segments, step, z, least, watch)
            return filter_fit(self._model, segments, step, first.z, least, first.noise, watch=watch)
        return filter_fit(self._model, segments, step, z, least, near.noise, near.disturbance, watch)

    def _watch(self, name: str) -> Watch:
        """What is called with the iteration and the cost of the next estimate."""
        left = ""
        if self._done:
            seconds = (self._count - self._done) * (time.perf_counter() - self._started) / self._done
            left = f", about {seconds:.0f} s left"
        label = f"estimate {self._done + 1} of {self._count} ({name}){left}"
        return lambda iteration, cost: self._say(f"{label}: iteration {iteration}, cost {cost:.6g}")

    def _unknowns(self, dives: Sequence[Dive], z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All unknowns where the parameters have some numbers and nothing else is known, and their smallest numbers."""
        least = Unknowns(tuple(self._parameters), len(dives)).least()
        unknowns = np.zeros(len(least))
        unknowns[: len(self._parameters)] = z
        return unknowns, least


def _packed(solution: Fit) -> dict[str, Any]:
    """The solution of an estimate as JSON can hold it: of the shares those that are not 1."""
    outliers = np.flatnonzero(solution.shares != 1.0)
    return {
        "z": solution.z.tolist(),
        "starts": solution.starts.tolist(),
        "noise": [float(noise) if np.isfinite(noise) else None for noise in solution.noise],
        "shape": list(solution.shares.shape),
        "outliers": outliers.tolist(),
        "shares": solution.shares.ravel()[outliers].tolist(),
        "iterations": solution.iterations,
        "converged": solution.converged,
        "disturbance": None if solution.disturbance is None else _plain(solution.disturbance),
    }


def _plain(disturbance: Disturbance) -> list[Any]:
    return [disturbance.deviations.tolist(), disturbance.correlation_time]


def _unpacked(answer: Mapping[str, Any]) -> Solution:
    disturbance = answer["disturbance"]
    shares = np.ones(answer["shape"])
    shares.ravel()[np.array(answer["outliers"], dtype=int)] = answer["shares"]
    return Solution(
        z=np.array(answer["z"]),
        starts=np.array(answer["starts"]),
        noise=np.array([np.inf if noise is None else noise for noise in answer["noise"]]),
        shares=shares,
        iterations=answer["iterations"],
        converged=answer["converged"],
        disturbance=None if disturbance is None else Disturbance(np.array(disturbance[0]), disturbance[1]),
    )
