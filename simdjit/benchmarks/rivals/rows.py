"""Rows of the table: for every tool, the cheapest of its settings that reaches the error that is asked for.

All are processor time on one core, the shortest of some repetitions, after a first call that compiles.
"""

import json
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from pendulum import ANSWERS, DURATION, RUNS
from timing import shortest

NAMES = {"alone": "free pendulum", "controlled": "pendulum under a sampled law"}
TARGETS = {"alone": (1e-6, 1e-10), "controlled": (1e-6,)}  # rad


class Settings(NamedTuple):
    """Settings to choose from, from cheap to dear, dense enough that none is favoured by where they lie."""

    words: str
    values: list[Any]


STEPS = Settings("{} steps", [round(40 * 1.12**i) for i in range(60)])
PARTS = Settings("{} steps a sample", [1, 2, 4])
TOLERANCES = Settings("tolerance {:.0e}", [10 ** (-i / 2) for i in range(6, 31)])

Work = Callable[[], np.ndarray]  # returns the angles at the end


class Row(NamedTuple):
    problem: str
    tool: str
    setting: str
    error: float | None  # rad, the largest of all runs
    ns: float | None  # of one run and second of its motion


def cheapest(problem: str, tool: str, settings: Settings, make: Callable[[Any], Work]) -> Iterable[Row]:
    """For every error that is asked for the first setting that reaches it; `make` compiles what a setting needs."""
    answer = ANSWERS[problem]()
    for target in TARGETS[problem]:
        named = f"{NAMES[problem]}, {target:.0e} rad"
        for value in settings.values:
            work = make(value)
            error = float(np.abs(work() - answer).max())
            if error <= target:
                yield Row(named, tool, settings.words.format(value), error, each(shortest(work)))
                break
        else:
            yield Row(named, tool, "not reached", None, None)


def print_cheapest(problem: str, tool: str, settings: Settings, make: Callable[[Any], Work]) -> None:
    print_rows(cheapest(problem, tool, settings, make))


def each(seconds: float) -> float:
    """Nanoseconds of one run and second of its motion."""
    return 1e9 * seconds / RUNS / DURATION


def print_rows(rows: Iterable[Row]) -> None:
    for row in rows:
        print(json.dumps(row._asdict()), flush=True)
