"""A prediction as plain data, for prediction.json."""

from typing import Any

from undertow.prediction.predict import Prediction


def summary(prediction: Prediction) -> dict[str, Any]:
    """Contents of prediction.json."""
    known = prediction.operating_point
    return {
        "position": known.mean.parts.target.position.tolist(),
        "mean_load": known.mean.at["load"].tolist(),
        "points": [
            {
                "share": point.share,
                "load": point.load.tolist(),
                "input": point.u.tolist(),
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
    }
