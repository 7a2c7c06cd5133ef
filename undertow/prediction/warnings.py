"""What is doubtful about a scenario by its prediction, with the numbers that say so: section 3.12 of the theory."""

import numpy as np

from undertow.controllers.composite_law import RCAF
from undertow.prediction.operating_point import has_weights
from undertow.prediction.predict import Prediction

# An estimator faster than this share of the sampling rate is at the mercy of sampling.
_SAMPLED = 0.35


def advice(prediction: Prediction) -> tuple[str, ...]:
    """Sentences, the gravest first."""
    return (
        *_stability(prediction),
        *_actuators(prediction),
        *_sampling(prediction),
        *_noise(prediction),
        *_drift(prediction),
        *prediction.lost,
    )


def _stability(prediction: Prediction) -> tuple[str, ...]:
    unstable = [point for point in prediction.points if point.found and point.radius >= 1]
    if not unstable:
        return ()
    worst = max(unstable, key=lambda point: point.radius)
    pole = worst.poles[0]
    turning = f" at {abs(pole.imag):.3g} rad/s" if pole.imag else ""
    moving = (
        " This is at fixed weights: weights that move apart add damping, so that a run may last or not. Run it"
        if has_weights(prediction.operating_point.built)
        else ""
    )
    return (
        f"the loop is unstable at {len(unstable)} of {len(prediction.points)} operating points: rightmost pole "
        f"{pole.real:+.3g} 1/s{turning}. Take preset: robust, or a slower estimator.{moving}".rstrip("."),
    )


def _actuators(prediction: Prediction) -> tuple[str, ...]:
    said, authority = [], prediction.authority
    if authority.held < 1:
        said.append(
            f"the actuators hold the demand for {authority.held:.0%} of the time only: at worst they give "
            f"{authority.share.min():.0%} of it. Ask for less, or take larger ones"
        )
    lost = [point for point in prediction.points if not point.found]
    if lost:
        said.append(f"no input holds the load at {len(lost)} of {len(prediction.points)} operating points")
    return tuple(said)


def _sampling(prediction: Prediction) -> tuple[str, ...]:
    said, law, dt = [], prediction.operating_point.built.closed_loop.controller, prediction.operating_point.linear.dt
    fastest = max((row[1] for row in prediction.estimators), default=0.0)
    if fastest * dt > _SAMPLED:
        said.append(
            f"the estimator's {fastest:.3g} rad/s times the sampling time of {1e3 * dt:g} ms is {fastest * dt:.2g}, "
            f"more than {_SAMPLED}: sampling shapes it. Take at most {_SAMPLED / dt:.3g} rad/s, or sample faster"
        )
    if isinstance(law, RCAF):
        least = np.max(np.asarray(law.robust_gain) * np.asarray(law.lyapunov())[..., 1, 1]) * dt
        layer = float(np.min(np.asarray(law.layer)))
        if layer < least:
            said.append(
                f"the boundary layer of {layer:.3g} is thinner than w_bar p22 dt = {least:.3g}: "
                "the robust term chatters"
            )
    return tuple(said)


def _noise(prediction: Prediction) -> tuple[str, ...]:
    axes = prediction.operating_point.around.load.shape[1]
    present = float(prediction.operating_point.around.noise[:, axes:].std(axis=0).max())
    largest = prediction.noise.largest
    if not present > largest or any(point.radius >= 1 for point in prediction.points):
        return ()  # an unstable loop has no stationary noise
    return (
        f"measured velocities are off by {present:.2g} m/s or rad/s (standard deviation); white noise of more than "
        f"{largest:.2g} fills the input by itself",
    )


def _drift(prediction: Prediction) -> tuple[str, ...]:
    if prediction.drift is None or prediction.drift[0] < prediction.drift[1]:
        return ()
    added, breaks = prediction.drift
    bound = "nothing bounds the weights" if np.isinf(added) else f"weights in their box may add {added:.3g} 1/s"
    return (
        f"{bound}, and noise or a lasting load drives them until {breaks:.3g} 1/s break the loop: set weights_bound",
    )
