"""Result of a tuning as a scenario and as data."""

from typing import Any

import numpy as np

from undertow.scenario.reading import dump
from undertow.tuning.tune import Evaluated, Tuned


def as_scenario(found: Tuned) -> str:
    """YAML that `undertow simulate` takes, with the certificate above it."""
    tuned = found.evaluated[-1]
    sets = list(dict.fromkeys(name for name in found.problem.train.variants if name))
    points = f"{len(tuned.certificate.radii)} operating points" + (f" of {', '.join(sets)}" if sets else "")
    head = (
        f"# Gains found by `undertow tune`, method {found.method}.\n"
        f"# Certificate: the exactly linearised closed loop has a spectral radius of {tuned.certificate.worst:.6f},\n"
        f"# below 1, over one control step; this is the largest at {points}.\n"
        f"# Cost {tuned.train_cost:.6g} on training runs, {tuned.held_out_cost:.6g} on held-out runs.\n"
    )
    return head + dump(found.scenario)


def as_data(found: Tuned) -> dict[str, Any]:
    """Contents of tuning.json; parts of the cost per run, in the order of `trials`."""
    sets = {"train": found.problem.train, "held_out": found.problem.held_out}
    return {
        "method": found.method,
        "elapsed": found.elapsed,
        "finished": found.finished,
        "evaluations": found.evaluations,
        "rejected": found.rejected,
        "parameters": [
            {"name": parameter.name, "low": parameter.low, "high": parameter.high}
            for parameter in found.problem.parameters
        ],
        "trials": {
            name: {"variants": list(trials.variants), "sizes": np.asarray(trials.sizes).tolist()}
            for name, trials in sets.items()
        },
        "gains": {one.name: _evaluate(one) for one in found.evaluated},
        "history": [step._asdict() for step in found.steps],
    }


def _evaluate(one: Evaluated) -> dict[str, Any]:
    return {
        "options": one.options,
        "train_cost": one.train_cost,
        "held_out_cost": one.held_out_cost,
        "spectral_radii": list(one.certificate.radii),
        "train": {name: np.asarray(part).tolist() for name, part in one.train._asdict().items()},
        "held_out": {name: np.asarray(part).tolist() for name, part in one.held_out._asdict().items()},
    }
