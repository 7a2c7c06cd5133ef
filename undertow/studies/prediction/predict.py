"""Predict a scenario without running it: operating points, margins, noise, frequency responses and metrics."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.actuator_authority import ActuatorAuthority, actuator_authority
from undertow.analysis.linearization.closed_forms import ClosedForm, closed_form_poles
from undertow.analysis.linearization.linear_loop import LinearLoop
from undertow.analysis.theory import theory_of
from undertow.core.arrays import as_array
from undertow.physics.plants.reachability import open_loop_advice
from undertow.scenario.build import Built, in_its_precision
from undertow.studies.prediction.linearized_points import (
    LinearizedPoint,
    linearized_points,
    nearest_to_instability,
    robustness,
)
from undertow.studies.prediction.operating_point import OperatingPoint, input_limits, operating_point, predicted
from undertow.studies.prediction.vehicle_margins import VehicleMargins, margins_over_vehicles

_SLOWEST = 1e-2  # rad/s
_HIGHEST = 1.0  # frequency times sampling time: a third of the Nyquist frequency
_NOISE = 0.01  # m/s and rad/s, for gains per unit of noise
_DEVIATIONS = 3.0  # standard deviations of noise between the input at rest and its limit

Progress = Callable[[str, float], None]  # called with a message and the share done


class VelocityNoise(NamedTuple):
    """White noise on the measured velocities, independent at every control step."""

    of_input: np.ndarray  # standard deviation per m/s or rad/s of noise
    of_estimate: np.ndarray  # 1/s
    largest: float  # noise, m/s and rad/s, at which three standard deviations of the input reach its limit


class Prediction(NamedTuple):
    """Result of `undertow analyze`."""

    operating_point: OperatingPoint
    points: tuple[LinearizedPoint, ...]
    margins: dict[str, float]  # at the point closest to instability
    noise: VelocityNoise
    frequency: np.ndarray  # rad/s
    error: np.ndarray  # |e / d| of each axis, (frequencies, axes); s^2
    estimation: np.ndarray  # |d_hat - d| / |d|, likewise
    forms: list[ClosedForm]
    estimators: list[tuple[str, float, float, float | None]]  # axis, w_o rad/s, zeta, |d_til| per |d_dot| s
    drift: (
        tuple[float, float] | None
    )  # largest gain that bounded weights can add, and the gain that destabilises the loop, 1/s
    authority: ActuatorAuthority
    lost: tuple[str, ...]
    metrics: dict[str, float] | None  # of the steady window
    why_not: str  # reason where there are none
    vehicles: tuple[VehicleMargins, ...] = ()  # within the deviations of the vehicle file; () without any


@in_its_precision
def predict(built: Built, progress: Progress = lambda message, share: None, vehicles: int = 0) -> Prediction:
    """Predict a scenario from its linearised closed loop.

    Args:
        built: scenario.
        progress: called with the current stage.
        vehicles: number of vehicles within the deviations of the vehicle file whose margins are computed, too.
    """
    progress("equilibrium", 0.0)
    op_point = operating_point(built)
    loop, settings = op_point.built.closed_loop, built.scenario.loop
    progress("poles at the operating points", 0.3)
    points = linearized_points(op_point)
    nearest = nearest_to_instability(points)
    worst = nearest.at
    progress("margins", 0.4)
    loop_margins = robustness(nearest, settings.dt)
    progress("noise and disturbances", 0.7)
    frequency = np.geomspace(_SLOWEST, _HIGHEST / settings.dt, 300)
    error, estimation = _responses(op_point.linear, frequency)
    law = loop.controller
    names = loop.plant.outputs
    metrics, why_not = predicted(op_point)
    axes = range(len(names))
    theory = theory_of(law)
    gains = np.asarray(law.model.dynamics.gain(loop.plant.output(as_array(0.0), worst.parts.states(worst.at)[0])))
    return Prediction(
        operating_point=op_point,
        points=points,
        margins=loop_margins,
        noise=_noise(op_point),
        frequency=frequency,
        error=error,
        estimation=estimation,
        forms=closed_form_poles(law, margins.poles(op_point.linear), names),
        estimators=[(names[i], *estimator, theory.ramp_error(i)) for i in axes if (estimator := theory.estimator(i))],
        drift=max((bound for i in axes if (bound := theory.drift_bound(i, settings.dt))), default=None),
        authority=actuator_authority(loop, op_point.mean, op_point.around.load),
        lost=open_loop_advice("the gain matrix", gains, names),
        metrics=metrics,
        why_not=why_not,
        vehicles=margins_over_vehicles(built, vehicles, progress),
    )


def _noise(op_point: OperatingPoint) -> VelocityNoise:
    dt = op_point.linear.dt
    axes = op_point.around.load.shape[1]
    sampled = margins.closed(op_point.mean, dt)
    velocity_noise = np.concatenate([np.zeros(axes), np.full(axes, _NOISE)])
    gain = lambda name: margins.noise_gain(sampled, name, velocity_noise) / _NOISE
    of_input, of_estimate = gain("u"), gain("estimate") if "estimate" in sampled.signals else np.zeros(axes)
    low, high = input_limits(op_point.built, op_point.mean)
    room = np.minimum(high - op_point.mean.at["u"], op_point.mean.at["u"] - low)
    with np.errstate(divide="ignore", invalid="ignore"):
        largest = float(np.maximum(room / (_DEVIATIONS * of_input), 0.0).min())
    return VelocityNoise(of_input, of_estimate, largest)


def _responses(linear: LinearLoop, frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """|e / d| of each output, and |d_hat - d| / |d| of each axis of the controller, under a load on the same axis.

    The estimate of a law that has none is zero.
    """
    answer = {name: margins.response(linear, name, frequency) for name in ("error", "uncertainty")}
    estimate = margins.response(linear, "estimate", frequency) if "estimate" in linear.signals else 0.0
    into_axes = linear.direct["uncertainty"]["load"]  # a load on the outputs in the controller's axes
    missed = (estimate - answer["uncertainty"]) @ np.linalg.inv(into_axes)
    diagonal = lambda matrices: np.abs(np.diagonal(matrices, axis1=1, axis2=2))
    return diagonal(answer["error"]), diagonal(missed)


def summary(prediction: Prediction) -> dict[str, Any]:
    """Contents of prediction.json."""
    op_point = prediction.operating_point
    return {
        "position": op_point.mean.parts.target.position.tolist(),
        "mean_load": op_point.mean.at["load"].tolist(),
        "points": [
            {
                "where": point.where,
                "flow": point.flow,
                "load": point.at.at["load"].tolist(),
                "input": point.at.at["u"].tolist(),
                "input_used": point.used,
                "held": point.found,
                "spectral_radius": point.radius,
                "poles": [[pole.real, pole.imag] for pole in point.poles],
            }
            for point in prediction.points
        ],
        "margins": prediction.margins,
        "noise": {
            "of_input": prediction.noise.of_input.tolist(),
            "of_estimate": prediction.noise.of_estimate.tolist(),
            "largest_velocity_noise": prediction.noise.largest,
        },
        "estimators": [
            dict(zip(("axis", "frequency", "damping", "ramp_error"), row, strict=True)) for row in prediction.estimators
        ],
        "closed_forms": [
            {
                "meaning": row.meaning,
                "expected": [row.expected.real, row.expected.imag],
                "nearest": [row.nearest.real, row.nearest.imag],
            }
            for row in prediction.forms
        ],
        "drift": prediction.drift,
        "actuator_authority": {
            "low": prediction.authority.low.tolist(),
            "high": prediction.authority.high.tolist(),
            "demand": prediction.authority.demand.tolist(),
            "held": prediction.authority.held,
            "smallest_share": float(prediction.authority.share.min()),
        },
        "uncontrollable": list(prediction.lost),
        "metrics": prediction.metrics,
        "why_no_metrics": prediction.why_not,
        "vehicles": [vehicle._asdict() for vehicle in prediction.vehicles],
    }
