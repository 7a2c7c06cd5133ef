"""An identification of a thruster as plain data for identification.json."""

import datetime
import importlib.metadata
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from undertow.scenario.provenance import recording_hash
from undertow.studies.identification.bench.bench_fit import JudgedFit
from undertow.studies.identification.bench.bench_table import MEASURED, BenchTable
from undertow.studies.identification.bench.identify_thruster import ThrusterIdentification, section_of
from undertow.studies.identification.bench.thruster_form import joined
from undertow.studies.identification.result_data import interval_data
from undertow.studies.identification.uncertainty import LEVEL


def thruster_data(identification: ThrusterIdentification, files: Sequence[Path]) -> dict[str, Any]:
    """All of it but the rows; the form to use first.

    Args:
        identification: result.
        files: of the records, in their order.
    """
    largest = identification.largest
    return {
        "date": datetime.date.today().isoformat(),
        "version": importlib.metadata.version("undertow"),
        "bench": [_bench_data(table, file) for table, file in zip(identification.tables, files, strict=True)],
        "largest_thrust": float(np.abs(joined(identification.tables, "thrust")).max()),
        "largest_voltage": largest,
        "level": LEVEL,
        "forms": [_form_data(fit, largest) for fit in identification.fits],
        "compared": dict(identification.compared),
        "findings": [str(finding) for finding in identification.findings],
        "not_identified": [
            {"name": finding.name, "sentence": str(finding)}
            for finding in identification.findings
            if finding.severity == "refused"
        ],
    }


def _bench_data(table: BenchTable, file: Path) -> dict[str, Any]:
    supplies = np.unique(np.round(table.supply, 1))
    return {
        "name": table.name,
        "sha256": recording_hash(file),
        "rows": len(table.volts),
        "supply": [float(supplies[0]), float(supplies[-1])],
        "duration": None if table.time is None else float(table.time[-1]),
        "measured": [name for name in MEASURED if table.has(name)],
    }


def _form_data(fit: JudgedFit, largest: float) -> dict[str, Any]:
    form = fit.problem.form
    thrust, half = fit.thrust_band(np.array([largest, -largest]))
    full = {
        direction: {"value": float(value), "low": float(value - reach), "high": float(value + reach), "unit": "N"}
        for direction, value, reach in zip(("forward", "reverse"), thrust, half, strict=True)
        if direction == "forward" or form.reverse
    }
    return {
        "form": form.name,
        "section": section_of(fit, largest),
        "parameters": {interval.parameter.name: interval_data(interval) for interval in fit.intervals},
        "correlation": fit.uncertainty.correlation(range(len(fit.uncertainty.covariance))).tolist(),
        "full_thrust": full,
        "rms": {name: fit.rms(name) for name in fit.left_out},
        "rms_left_out": dict(fit.left_out),
        "converged": fit.fit.converged,
    }
