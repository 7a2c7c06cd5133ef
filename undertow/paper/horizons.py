"""The second horizon of the fidelity levels: 2,000 s of suite U2, because 20 s are too short for weights that drift.

All runs are sampled at 1 kHz, for the paper's laws as they are and with their weights projected into a box.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from undertow.analysis.success import DEFAULT, evaluate_success
from undertow.paper.running import BatchedRun
from undertow.paper.setup import FIDELITIES, RAFC, RCAFC, equal_gain, scenario

LONG, QUICK = 2000.0, 200.0  # s

# Windows of the metrics, s; the first is the `steady` one of the runs of 20 s, whose load U2 repeats.
WINDOWS = ((10.0, 20.0), (100.0, 200.0), (1000.0, 2000.0))

WHOLE = FIDELITIES[-1]
BOUND = 20.0  # m/s^2, rad/s^2; of workload W1

# gamma_eps of workload W1, and others tried with the full motor model.
_W1 = 20.0
_SWEEP = (30.0, 10.0, 5.0)

_KEPT = 60  # points of a curve in results.json

Long = Mapping[str, BatchedRun]


def duration(quick: bool) -> float:
    """s."""
    return QUICK if quick else LONG


def windows(quick: bool) -> tuple[tuple[float, float], ...]:
    """Windows of the horizon, s."""
    return tuple(window for window in WINDOWS if window[1] <= duration(quick))


def sampled(seconds: float, substeps: int = 1) -> dict[str, Any]:
    """Loop at 1 kHz, recorded every second."""
    return {"kind": "sampled", "duration": seconds, "record": min(1.0, seconds / 20), "substeps": substeps}


def scenarios(quick: bool) -> dict[str, dict[str, Any]]:
    """Every long run, by name."""
    return {name: data for name, (_, data) in _runs(quick).items()}


def table(long: Long, quick: bool) -> list[dict[str, Any]]:
    """One row per run: its duration; tracking, chattering and weights in every window that it reached."""
    return [described(name, facts, long[name]) for name, (facts, _) in _runs(quick).items()]


def described(name: str, facts: dict[str, Any], run: BatchedRun) -> dict[str, Any]:
    """A row of results.json: description of a run, its ending, metrics by window, growth of its weights."""
    over = lambda metric: [None if window_metrics is None else window_metrics[metric] for window_metrics in run.windows]
    peaks = run.series["weights_peak"]
    indices = np.unique(np.geomspace(1, max(len(peaks) - 1, 1), _KEPT).round().astype(int)) if len(peaks) > 1 else [0]
    reached = [window_metrics for window_metrics in run.windows if window_metrics is not None]
    success = evaluate_success(DEFAULT, reached[-1]) if run.lasted and reached else None
    return facts | {
        "scenario": f"scenarios/{name}.yaml",
        "status": run.status.word,
        "ended": run.ended,
        "lasted": run.lasted,
        "within": success is not None and success.within,  # over the last window that it reached
        "tracking_rms": over("tracking_rms"),
        "estimation_rms": over("estimation_rms"),
        "input_variation": over("input_variation"),
        "weights_peak": over("weights_peak"),
        "growth": {"time": run.time[indices].tolist(), "weights_peak": peaks[indices].tolist()},
    }


def name_of(level: str, law: str, bounded: bool = False) -> str:
    """Name of a long run."""
    return f"long_{level}_{law}{'_bounded' if bounded else ''}"


def _runs(quick: bool) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """By name: level, law and bound of a run, and its scenario."""
    laws: dict[str, tuple[str, float, dict[str, Any]]] = {
        "rcafc": ("RCAFC, Table 1", RCAFC, {}),
        "w1": (f"gamma_eps {_W1:g} (W1)", _W1, {}),
        "rafc": ("RAFC, Table 1", RAFC, {}),
        "rafc_equal_gain": ("RAFC, gamma raised", RAFC, equal_gain()),
    }
    swept = {f"composite_{value:g}": (f"gamma_eps {value:g}", value, {}) for value in _SWEEP}
    one_rule = {"one_rule": ("one rule, gamma_eps 5", 5.0, {"sets": 1})}
    runs = {}
    for level in FIDELITIES[2:] if quick else FIDELITIES:
        more = swept | one_rule if level == WHOLE and not quick else {}
        for law, (words, composite, gains) in (laws | more).items():
            for bounded in (False, True):
                name = name_of(level, law, bounded)
                words_too = f"{words}, weights within {BOUND:g}" if bounded else words
                facts = {"level": level, "law": law, "words": words_too, "composite": composite, "bounded": bounded}
                runs[name] = (facts, _scenario(words_too, level, quick, composite, gains, bounded))
        if not quick:
            name = name_of(level, "robust")
            facts = {"level": level, "law": "robust", "words": "robust", "composite": None, "bounded": True}
            data = _scenario("preset robust", level, quick, 0.0, {}, False)
            runs[name] = (facts, data | {"controller": {"kind": "rcaf", "preset": "robust"}})
    return runs


def _scenario(words: str, level: str, quick: bool, composite: float, gains: dict, bounded: bool) -> dict[str, Any]:
    return scenario(
        f"{words} at fidelity {level}, suite U2 for {duration(quick):g} s, 1 kHz",
        fidelity=level,
        composite=composite,
        controller=gains | {"weights_bound": BOUND if bounded else math.inf},
        disturbance={"kind": "u2"},
        loop=sampled(duration(quick)),
    )
