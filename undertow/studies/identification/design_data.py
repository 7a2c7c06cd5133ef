"""A designed experiment as plain data for experiment.json, and as files that other commands take."""

from pathlib import Path
from typing import Any

from undertow.core.atomic_io import write_whole
from undertow.scenario.reading import dump
from undertow.studies.identification.block_choice import HALF
from undertow.studies.identification.design_result import Design, ExpectedDeviation


def design_data(design: Design) -> dict[str, Any]:
    """All of it but the script and the rehearsal."""
    limits = design.limits
    return {
        "duration": design.scenario["loop"]["duration"],
        "station": design.scenario["reference"]["position"],
        "limits": {
            "room": list(limits.room),
            "depth": list(limits.depth),
            "rate": limits.rate,
            "angle": limits.angle,
            "input": limits.input,
        },
        "parameters": {expected.parameter.name: _expected_data(expected) for expected in design.expected},
        "undetermined": [
            {"parameters": list(combination.names), "sentence": combination.sentence(), "share": combination.share}
            for combination in design.undetermined
        ],
        "blocks": [{"form": b.form, "where": b.where, "size": design.scale * b.size} for b in design.blocks],
        "largest_use_of_limits": list(design.use),
        "farthest": [float(value) for value in abs(design.rehearsal.away).max(axis=0)],
        "notes": list(design.notes),
    }


def _expected_data(expected: ExpectedDeviation) -> dict[str, Any]:
    return {
        "unit": expected.parameter.unit,
        "value": expected.parameter.prior,
        "before": expected.before,
        "after": expected.after,
        "deviation_left": expected.share,
        "halved": expected.share < HALF,
        "of_interest": expected.is_of_interest,
    }


def write_experiment(design: Design, folder: Path) -> None:
    """Write experiment.yaml and experiment.csv, the script.

    Raises:
        OSError: the folder cannot be written.
    """
    controller = dict(design.scenario["controller"])
    write_whole(folder / "experiment.csv", controller.pop("csv"))
    controller = {"kind": controller.pop("kind"), "file": "experiment.csv", **controller}
    write_whole(folder / "experiment.yaml", dump(design.scenario | {"controller": controller}))
