"""Checks of a log before anything is fitted: what cannot be used or identified, and what to do about it."""

import math
from collections.abc import Iterator

import numpy as np

from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_AXES
from undertow.logs.log_signals import LogSignals, Series
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.studies.identification.clock_offset import ClockOffset
from undertow.studies.identification.dive import Dive, dive_of, measured_by
from undertow.studies.identification.finding import SEVERITIES, DiveCheck, LogFinding
from undertow.studies.identification.free_parameters import axis_parameters, chosen, parameters_of, shortest_lag
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.input_check import axis_findings, input_findings
from undertow.studies.identification.input_signs import InputGains, input_gains
from undertow.studies.identification.motion_check import is_in_degrees, rates_findings, velocity_findings
from undertow.studies.identification.stream_check import outlier_findings, sensor_series, stream_findings

_STEP = 0.05  # s
_MOST_PARTS = 10  # of such a step
_TURNED = 0.5  # rad, from which on a heading has surely changed


def check_dive(
    log: LogSignals, inputs: Series, vehicle: HybridVehicle | None = None, per_axis: bool = False
) -> DiveCheck:
    """All checks of a log.

    Args:
        log: with some of position or depth, attitude, velocity, angular velocity.
        inputs: of the thrusters or axes.
        vehicle: that dived; without one, the effects of the inputs are not judged.
        per_axis: whether the inputs push along the six axes.
    """
    if per_axis and inputs.values.shape[1:] == (len(BODY_AXES),):
        inputs = inputs._replace(columns=BODY_AXES)
    series = sensor_series(log)
    findings = stream_findings(series, log.duration())
    useless = {finding.name for finding in findings if finding.severity == "left_out"}
    if not set(series) - useless:
        sentence = "The log has no motion: no attitude, velocity, angular velocity, position or depth that can be used"
        findings.append(LogFinding("log", "", "refused", sentence, "Map the columns or topics that hold them"))
    findings += input_findings(inputs, vehicle, per_axis)
    is_finite = np.isfinite(inputs.values.reshape(-1, len(inputs.column_names()))).all(axis=1)
    inputs = inputs._replace(time=inputs.time[is_finite], values=inputs.values[is_finite])
    offsets: dict[str, ClockOffset] = {}
    measured = {name: stream for name, stream in measured_by(log).items() if name not in useless}
    if "attitude" in series and "attitude" not in useless:
        findings += _attitude_findings(series["attitude"], measured, offsets)
    if not any(finding.concern == "log" and finding.severity == "refused" for finding in findings):
        findings += outlier_findings(measured)
        step = _STEP if vehicle is None or per_axis else _step_of(vehicle)
        dive = _dive(log, inputs, step, {finding.name for finding in findings if finding.severity == "left_out"})
        gains = None if dive is None or vehicle is None else _gains(vehicle, dive, inputs, per_axis)
        if gains is not None:
            findings += gains.findings
            offsets["inputs"] = gains.offset
        findings += _axis_findings(dive, gains)
    grave = {finding.name for finding in findings if finding.severity != "note"}
    findings = [finding for finding in findings if finding.severity != "note" or finding.name not in grave - {""}]
    findings.sort(key=lambda finding: -SEVERITIES.index(finding.severity))
    known = {name: offset for name, offset in offsets.items() if math.isfinite(offset.deviation)}
    return DiveCheck(tuple(findings), known)


def _attitude_findings(attitude: Series, measured: dict, offsets: dict[str, ClockOffset]) -> Iterator[LogFinding]:
    """Units of the attitude, its heading, and whether other sensors agree with it."""
    in_degrees = is_in_degrees(attitude)
    if in_degrees is None and not _has_heading(attitude):
        yield from _heading_findings(attitude, measured)
        return
    findings, offset = rates_findings(attitude, measured["rates"]) if "rates" in measured else ([], None)
    if offset is not None:
        offsets["rates"] = offset
    units = [finding for finding in findings if finding.concern == "log"]
    if in_degrees is not None and not units:
        units = [in_degrees]
    yield from units or findings
    if not units and "position" in measured and "velocity" in measured:
        findings, offset = velocity_findings(measured["attitude"], measured["position"], measured["velocity"])
        yield from findings
        if offset is not None:
            offsets["velocity"] = offset


def _has_heading(attitude: Series) -> bool:
    yaw = attitude.values[np.isfinite(attitude.values).all(axis=1), 2]
    return len(yaw) > 0 and float(np.ptp(yaw)) > 1e-6


def _heading_findings(attitude: Series, measured: dict) -> Iterator[LogFinding]:
    """What an attitude without a heading means."""
    yaw = attitude.values[np.isfinite(attitude.values).all(axis=1), 2]
    time, rates = measured.get("rates", (np.zeros(2), np.zeros((2, 3))))
    turned = float(np.ptp(np.cumsum(np.diff(time) * rates[1:, 2]))) if len(time) > 1 else 0.0
    known = f", while r says that the vehicle turns by {turned:.1f} rad" if turned > _TURNED else ""
    sentence = f"The attitude has no heading: yaw is {yaw.mean():.2f} rad throughout{known}"
    yield LogFinding(
        "sensor", "attitude.yaw", "left_out", sentence, "Map the heading, or identify without the position"
    )
    if "position" in measured:
        sentence = "Without a heading the position cannot be predicted from velocities in body axes"
        yield LogFinding("sensor", "position", "left_out", sentence)


def _step_of(vehicle: HybridVehicle) -> float:
    """Step of the check, s: no longer than the lag of the thrusters.

    A longer step of the fourth-order integration makes the answer of the thrusters slower than it is, so that the
    inputs would seem to come late.
    """
    lag = shortest_lag(vehicle)
    parts = 1 if lag is None else min(_MOST_PARTS, math.ceil(_STEP / lag))
    return _STEP / parts


def _dive(log: LogSignals, inputs: Series, step: float, left_out: set[str]) -> Dive | None:
    """The log on a grid without the sensors that are left out; None where nothing remains."""
    try:
        dive = dive_of(log, inputs, step)
    except BadInput:
        return None
    counts = dive.counts.copy()
    for number, sensor in enumerate(("position", "attitude", "velocity", "rates", "depth")):
        if sensor in left_out or any(name.startswith(f"{sensor}.") and sensor != "attitude" for name in left_out):
            counts[:, number] = 0
    return dive._replace(counts=counts) if counts.any() else None


def _gains(vehicle: HybridVehicle, dive: Dive, inputs: Series, per_axis: bool) -> InputGains | None:
    """Gains of the inputs; None where they are of another number than thrusters or axes, or no window is whole."""
    expected = 6 if per_axis else vehicle.inputs()
    if dive.inputs.shape[1] != expected or dive.duration < 5.0:
        return None
    parameters = chosen(parameters_of(vehicle) | axis_parameters())
    return input_gains(prior_vehicle(vehicle, per_axis), parameters, [dive], tuple(inputs.column_names()))


def _axis_findings(dive: Dive | None, gains: InputGains | None) -> Iterator[LogFinding]:
    if dive is None:
        sentence = "Inputs and motion are not there at the same time"
        yield LogFinding("log", "", "refused", sentence, "Check the times of both in the log: they need one clock")
        return
    yield from axis_findings(dive, None if gains is None else gains.effect)
