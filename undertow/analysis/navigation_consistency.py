"""Whether the navigation filter of a finished run was as accurate as it said, and what it assumed of its sensors."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from undertow.control.navigation.from_sensors import SensorNavigation, sensor_names
from undertow.control.navigation.kalman import Kalman
from undertow.physics.sensors.propeller_speed import PropellerSpeed
from undertow.physics.sensors.sensor import AbstractSensor
from undertow.simulation.loop.closed_loop import ClosedLoop

_EXPECTED = 9  # mean of the normalised square of errors of three positions, three velocities and three angles
_TOO_LARGE = 2  # times as much; the mean of a run departs less by chance


def navigation_consistency(
    loop: ClosedLoop, run: xr.Dataset, metrics: Mapping[str, Any] | None
) -> dict[str, Any] | None:
    """What the filter assumed, and what its innovations and the truth say of it; None for a loop without such a filter.

    Args:
        loop: the closed loop that was run.
        run: its dataset.
        metrics: of the steady window; None where the run did not reach it.

    Returns:
        `sensors`: name, assumed standard deviations, and innovations of each; `nees`, or None; `findings`: sentences.
    """
    navigation = loop.navigation
    if not (isinstance(navigation, SensorNavigation) and isinstance(navigation.filter, Kalman)):
        return None
    kalman, sensors = navigation.filter, []
    for i, (name, sensor) in enumerate(zip(sensor_names(kalman.sensors), kalman.sensors, strict=True)):
        if not isinstance(sensor, PropellerSpeed):
            sensors.append({"sensor": name} | _assumed(kalman, sensor) | _innovations(run, i))
    nees = None if metrics is None else metrics.get("nees")
    return {"sensors": sensors, "nees": nees, "findings": [*_findings(sensors, nees), *_gate_findings(run)]}


def _assumed(kalman: Kalman, sensor: AbstractSensor) -> dict[str, list[float]]:
    """Standard deviations that the filter assumes: of the noise of each entry, and of the correlated errors."""
    scale = float(np.asarray(kalman.noise_scale))
    sampling = sensor.sampling
    plain = lambda values, factor=1.0: (factor * np.ravel(np.asarray(values, dtype=float))).tolist()
    deviations = {"noise": plain(sampling.noise, scale), "correlated": [], "correlation_time": []}
    errors = sampling.errors
    if kalman.sensor_error_states and errors is not None:
        deviations |= {"correlated": plain(errors.deviation, scale), "correlation_time": plain(errors.correlation_time)}
    return deviations


def _innovations(run: xr.Dataset, sensor: int) -> dict[str, float]:
    """Innovations of a sensor where they contradict the filter most, or at the end where they never do."""
    of_sensor = lambda name: run[name].values[:, sensor]
    flagged = of_sensor("inconsistent_sensors") > 0
    worst = lambda name: float(of_sensor(name)[flagged].max() if flagged.any() else of_sensor(name)[-1])
    return {
        "innovation_rms": worst("innovation_rms"),
        "innovation_correlation": worst("innovation_correlation"),
        "inconsistent": float(flagged.mean()),
    }


def _findings(sensors: list[dict[str, Any]], nees: float | None) -> list[str]:
    """Sentences about a filter that is surer than it may be."""
    contradicted = [sensor for sensor in sensors if sensor["inconsistent"] > 0]
    findings = []
    if contradicted:
        contradictions = ", ".join(
            f"those of {sensor['sensor']} are {sensor['innovation_rms']:.2g} times as large as it assumes and "
            f"correlated by {sensor['innovation_correlation']:.2f} from one reading to the next"
            for sensor in contradicted
        )
        findings.append(
            f"The navigation filter is inconsistent with its innovations: {contradictions}. State such errors in the "
            "sensors (`correlated_noise`, `correlation_time`; of a compass `hard_iron`, `soft_iron`, `interference`), "
            "or raise its `noise_scale`"
        )
    if nees is not None and nees > _TOO_LARGE * _EXPECTED:
        unseen = "" if contradicted else ", and no innovation shows it"
        findings.append(
            f"The errors of the navigation filter are {math.sqrt(nees / _EXPECTED):.2g} times as large as it says "
            f"(`nees` is {nees:.3g}, {_EXPECTED} is expected){unseen}"
        )
    return findings


def _gate_findings(run: xr.Dataset) -> list[str]:
    """Sentences about gates of the filter that had to act."""
    inertial, reopened = (int(run[name].values[-1]) for name in ("rejected_inertial", "reopened_gates"))
    findings = []
    if inertial:
        findings.append(
            f"The navigation filter did not believe {inertial} samples of the IMU: no motion of the vehicle explains "
            "them. Look for glitches, or raise its `inertial_factor` or `largest_rate`"
        )
    if reopened:
        findings.append(
            f"The navigation filter was wrong {reopened} times: most sensors contradicted it, and were believed again"
        )
    return findings
