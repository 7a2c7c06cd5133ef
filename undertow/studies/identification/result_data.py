"""An identification as plain data for identification.json."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.studies.identification.dive import RESIDUALS, SENSOR_OF_RESIDUAL
from undertow.studies.identification.identify import Identification, Validation
from undertow.studies.identification.kalman_gains import Disturbance
from undertow.studies.identification.uncertainty import LEVEL, ParameterInterval
from undertow.studies.identification.validation import HORIZONS, PredictionErrors, Whiteness, whiteness


def as_data(identification: Identification) -> dict[str, Any]:
    """All of it but the time series."""
    count = len(identification.parameters)
    estimate = identification.estimate
    return {
        "dives": [
            {"name": dive.name, "duration": dive.duration, "sensors": dive.sensors()} for dive in identification.dives
        ],
        "level": LEVEL,
        "parameters": {
            interval.parameter.name: interval_data(interval) | _profile_data(identification, interval.parameter.name)
            for interval in identification.intervals
        },
        "correlation": identification.uncertainty.correlation(range(count)).tolist(),
        "correlation_time": identification.uncertainty.correlation_time,
        "undetermined": [
            {"parameters": list(combination.names), "sentence": combination.sentence(), "share": combination.share}
            for combination in identification.undetermined
        ],
        "validation": [_validation_data(one, identification.velocities) for one in identification.validation],
        "published": _published_data(identification),
        "refused_axes": list(identification.refused_axes),
        "noise": {
            name: float(noise) for name, noise in zip(RESIDUALS, estimate.noise, strict=True) if np.isfinite(noise)
        },
        "residuals": {name: test._asdict() | {"is_white": test.is_white} for name, test in _whiteness(identification)},
        "method": "output_error" if estimate.disturbance is None else "prediction_error",
        "disturbance": {} if estimate.disturbance is None else _disturbance_data(estimate.disturbance),
        "iterations": estimate.iterations,
        "converged": estimate.converged,
        "findings": list(identification.findings),
    }


def _profile_data(identification: Identification, name: str) -> dict[str, Any]:
    """Ends of the interval by the profile of the likelihood, None where there is no end; nothing if not asked for."""
    if name not in identification.profiles:
        return {}
    return {"profile": [end if math.isfinite(end) else None for end in identification.profiles[name]]}


def _disturbance_data(disturbance: Disturbance) -> dict[str, Any]:
    """Standard deviation of the acceleration by axis, m/s^2 and rad/s^2, and correlation time, s."""
    deviations = dict(zip(BODY_AXES, disturbance.deviations.tolist(), strict=True))
    return {"deviations": deviations, "correlation_time": disturbance.correlation_time}


def _whiteness(identification: Identification) -> Iterator[tuple[str, Whiteness]]:
    """Of the residuals of each sensor, at its samples."""
    segments = identification.estimate.segments
    counts = segments.counts[:, :, SENSOR_OF_RESIDUAL] > 0
    length = segments.values.shape[1]
    inputs = segments.inputs[:, -length:]
    for i, name in enumerate(RESIDUALS):
        there = counts[:, :, i]
        if there.any():
            yield name, whiteness(identification.estimate.residuals[:, :, i][there], inputs[there])


def interval_data(interval: ParameterInterval) -> dict[str, Any]:
    """What is known of a parameter."""
    return {
        "unit": interval.parameter.unit,
        "value": interval.value,
        "low": interval.low,
        "high": interval.high,
        "deviation": interval.deviation,
        "prior": interval.parameter.prior,
        "deviation_left": interval.share,
        "shift": interval.shift,
        "verdict": interval.verdict,
    }


def _validation_data(validation: Validation, velocities: Sequence[str]) -> dict[str, Any]:
    return {
        "name": validation.name,
        "is_unseen": validation.is_unseen,
        "identified": _errors_data(validation.identified, velocities),
        "prior": _errors_data(validation.prior, velocities),
    }


def _published_data(identification: Identification) -> dict[str, dict[str, float]]:
    """Mean free-run fit of each published parameter set, %, by axis.

    Over the dives that were not used at all where there are any, otherwise over those left out in turn.
    """
    validation = [one for one in identification.validation if one.is_unseen] or identification.validation
    means = {}
    for name in validation[0].published if validation else ():
        fits = [_fits(one.published[name], identification.velocities) for one in validation]
        axes = dict.fromkeys(axis for fit in fits for axis in fit)
        means[name] = {axis: float(np.mean([fit[axis] for fit in fits if axis in fit])) for axis in axes}
    return means


def _fits(errors: PredictionErrors, velocities: Sequence[str]) -> dict[str, float]:
    """Free-run fit of the velocities that were identified and measured, %."""
    return {axis: value for axis, value in errors.fit.items() if axis in velocities and not math.isnan(value)}


def _errors_data(errors: PredictionErrors, velocities: Sequence[str]) -> dict[str, Any]:
    ahead = {
        f"{horizon:g}": {name: float(value) for name, value in zip(RESIDUALS, row, strict=True) if np.isfinite(value)}
        for horizon, row in zip(HORIZONS, errors.ahead, strict=True)
    }
    return {"free_run_fit": _fits(errors, velocities), "rms_ahead": ahead}
