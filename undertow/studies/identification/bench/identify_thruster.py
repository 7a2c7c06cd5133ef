"""Identification of a thruster: from bench records to the options of a part, with intervals and left-out errors."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from undertow.core.runtime import in_precision
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.studies.identification.bench.bench_check import check_bench, has_reverse
from undertow.studies.identification.bench.bench_fit import JudgedFit, fitted, judged
from undertow.studies.identification.bench.bench_problem import BenchProblem
from undertow.studies.identification.bench.bench_response import held_command, response_over_time, settled_response
from undertow.studies.identification.bench.bench_table import BenchTable
from undertow.studies.identification.bench.thruster_form import CurveForm, MotorForm, ThrusterForm, joined
from undertow.studies.identification.finding import LogFinding
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.uncertainty import ParameterInterval

Say = Callable[[str], None]

_QUIET = 5e-3  # share of the largest thrust, up to which there is none
_SETTLED = 0.6  # s after a change of the command, when the thrust of small thrusters has settled
_FEWEST_LATE = 5  # rows of a held command, of which a mean is taken
_FEWEST_SPEEDS = 5  # rows with speed and current, below which no motor is fitted
# Share of the largest thrust by which a motor may predict thrust worse than a curve and still be taken: it knows the
# current too, what another supply does, and how the lag depends on the speed.
_WORTH = 0.01
_DETERMINED_ZONE = 0.06  # of the largest voltage: deviation of a dead zone before


class ThrusterIdentification(NamedTuple):
    """Result of an identification of a thruster.

    Attributes:
        tables: records.
        findings: of their checks.
        fits: judged forms of the thruster; the one to use first: a motor unless it predicts thrust clearly worse.
        compared: rms of the errors of thrust, N, of other thrusters on the same rows, by name.
    """

    tables: tuple[BenchTable, ...]
    findings: tuple[LogFinding, ...]
    fits: tuple[JudgedFit, ...]
    compared: Mapping[str, float]

    @property
    def best(self) -> JudgedFit:
        """The form to use."""
        return self.fits[0]

    @property
    def largest(self) -> float:
        """Voltage of the records, V."""
        return float(np.abs(joined(self.tables, "volts")).max())


def identify_thruster(
    tables: Sequence[BenchTable], others: Mapping[str, AbstractThruster] | None = None, say: Say = lambda stage: None
) -> ThrusterIdentification:
    """Identify a thruster.

    Args:
        tables: records of one thruster.
        others: thrusters to compare with, by name.
        say: called with what is done.

    Raises:
        BadInput: nothing can be identified, with the reason.
    """
    findings = check_bench(tables)
    left_out = {finding.name for finding in findings if finding.severity == "left_out"}
    tables = [_without(table, left_out) for table in tables]
    with in_precision("float64"):
        fits = []
        for form_class in (CurveForm, MotorForm) if _has_motor(tables) else (CurveForm,):
            say(f"fitting the {form_class.name}")
            fits.append(_of_form(form_class, tables, has_reverse(findings)))
    largest = float(np.abs(joined(tables, "thrust")).max())
    fits.sort(
        key=lambda fit: fit.left_out["thrust"] - (_WORTH * largest if isinstance(fit.problem.form, MotorForm) else 0.0)
    )
    delay = fits[0].problem.values(fits[0].fit.z).get("delay", 0.0)
    with in_precision("float64"):
        compared = {name: _thrust_error(thruster, tables, delay) for name, thruster in (others or {}).items()}
    return ThrusterIdentification(tuple(tables), findings, tuple(fits), compared)


def section_of(fit: JudgedFit, largest: float) -> dict[str, Any]:
    """The section `thruster` of a scenario, with the largest voltage of the bench as the supply."""
    values = fit.problem.values(fit.fit.z)
    return {**fit.problem.form.section(values, fit.problem.tables), "supply": float(largest)}


def _of_form(form_class: type[ThrusterForm], tables: Sequence[BenchTable], reverse: bool) -> JudgedFit:
    """The better of both kinds of dead zone: one that passes what is beyond it, and one that is subtracted."""
    largest = float(np.abs(joined(tables, "volts")).max())
    lagging = any(table.time is not None for table in tables)
    bracket = _dead_zone(tables)
    kinds = ("subtract",) if bracket is None else ("subtract", "pass")
    candidates = []
    for kind in kinds:
        zone = sum(bracket) / 2 if bracket is not None and kind == "pass" else 0.0
        problem = BenchProblem(form_class(largest, kind, zone, reverse, lagging), tables)
        candidates.append((problem, fitted(problem)))
    problem, fit = min(candidates, key=lambda candidate: _cost(candidate[1].errors, candidate[0].largest))
    result = judged(problem, fit)
    if problem.form.dead_zone_kind == "pass" and bracket is not None:
        result = result._replace(intervals=(*result.intervals, _zone_interval(bracket, largest)))
    return result


def _cost(errors: np.ndarray, largest: np.ndarray) -> float:
    """Squares of the errors, each as a share of the largest value of its quantity."""
    return float(((errors / np.where(largest > 0, largest, 1.0)) ** 2).sum())


def _has_motor(tables: Sequence[BenchTable]) -> bool:
    known = np.isfinite(joined(tables, "speed")) & np.isfinite(joined(tables, "current"))
    return int((known & (joined(tables, "volts") > 0)).sum()) >= _FEWEST_SPEEDS


def _without(table: BenchTable, names: set[str]) -> BenchTable:
    """The record without columns that must not be used."""
    return table._replace(**{name: np.full(len(table.volts), np.nan) for name in ("current", "speed") if name in names})


def _dead_zone(tables: Sequence[BenchTable]) -> tuple[float, float] | None:
    """The largest voltage without thrust and the smallest with some, in order; None where nothing settles."""
    points = [point for table in tables for point in _settled_points(table)]
    if not points:
        return None
    volts, thrust = np.abs(np.array(points)).T
    quiet = thrust <= _QUIET * thrust.max()
    without = float(volts[quiet].max(initial=0.0))
    least = float(volts[~quiet].min())
    return min(without, least), max(without, least)


def _settled_points(table: BenchTable) -> list[tuple[float, float]]:
    """Voltage and thrust of settled rows; of a record over time the mean of each command that was held for long."""
    if table.time is None:
        return list(zip(table.volts, table.thrust, strict=True))
    points = []
    changes = np.flatnonzero(np.diff(table.volts) != 0) + 1
    for rows in np.split(np.arange(len(table.volts)), changes):
        late = rows[table.time[rows] >= table.time[rows[0]] + _SETTLED]
        if len(late) >= _FEWEST_LATE:
            points.append((float(table.volts[late[0]]), float(table.thrust[late].mean())))
    return points


def _zone_interval(bracket: tuple[float, float], largest: float) -> ParameterInterval:
    """A dead zone that lies evenly between two voltages."""
    low, high = bracket
    middle, deviation = (low + high) / 2, (high - low) / np.sqrt(12)
    before = _DETERMINED_ZONE * largest
    parameter = FreeParameter("dead_zone", "V", middle, before, least=0.0)
    return ParameterInterval(parameter, middle, low, high, float(deviation), float(deviation / before), 0.0)


def _thrust_error(thruster: AbstractThruster, tables: Sequence[BenchTable], delay: float) -> float:
    """Rms of the error of thrust, N, where commands arrive late by a delay (s)."""
    errors = []
    for table in tables:
        if table.time is None:
            thrust = settled_response(thruster, jnp.asarray(table.volts)).thrust
        else:
            command = held_command(table.volts, table.time)
            thrust = response_over_time(thruster, thruster.initial_state(1), command, delay).thrust
        errors.append(np.asarray(thrust) - table.thrust)
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
