"""Warnings about a scenario from its prediction, with their numbers: section 3.12 of the theory."""

import numpy as np

from undertow.analysis.theory import theory_of
from undertow.studies.prediction.predict import Prediction

# Sampling dominates an estimator with a larger product of bandwidth and sampling time.
_SAMPLED = 0.35


def advice(prediction: Prediction) -> tuple[str, ...]:
    """Warnings, the most severe first."""
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
    sentence = (
        f"the loop is unstable at {len(unstable)} of {len(prediction.points)} operating points: rightmost pole "
        f"{pole.real:+.3g} 1/s{turning}. A higher rate of control, or other gains, may help: `undertow tune`"
    )
    if theory_of(prediction.operating_point.built.closed_loop.controller).adapts:
        sentence += ". This holds for fixed weights: drifting weights add damping, so that a run may still last. "
        sentence += "Simulate it to find out"
    return (sentence,)


def _actuators(prediction: Prediction) -> tuple[str, ...]:
    warnings = []
    authority = prediction.authority
    if authority.held < 1:
        warnings.append(
            f"the actuators meet the demand for only {authority.held:.0%} of the time, and give "
            f"{authority.share.min():.0%} of it at worst. Reduce the demand, or use larger actuators"
        )
    lost = [point for point in prediction.points if not point.found]
    if lost:
        warnings.append(
            f"no equilibrium was found under the load at {len(lost)} of {len(prediction.points)} operating points"
        )
    return tuple(warnings)


def _sampling(prediction: Prediction) -> tuple[str, ...]:
    warnings = []
    dt = prediction.operating_point.linear.dt
    law = prediction.operating_point.built.closed_loop.controller
    fastest = max((row[1] for row in prediction.estimators), default=0.0)
    if fastest * dt > _SAMPLED:
        warnings.append(
            f"the estimator is too fast for the sampling time: {fastest:.3g} rad/s times {1e3 * dt:g} ms is "
            f"{fastest * dt:.2g}, more than {_SAMPLED}. Use at most {_SAMPLED / dt:.3g} rad/s, or sample faster"
        )
    if (layers := theory_of(law).thinnest_layer) is not None:
        least, layer = layers(dt)
        if layer < least:
            warnings.append(
                f"the robust term chatters: its boundary layer of {layer:.3g} is thinner than w_bar p22 dt = "
                f"{least:.3g}"
            )
    return tuple(warnings)


def _noise(prediction: Prediction) -> tuple[str, ...]:
    axes = prediction.operating_point.around.load.shape[1]
    present = float(prediction.operating_point.around.noise[:, axes:].std(axis=0).max())
    largest = prediction.noise.largest
    if not present > largest or any(point.radius >= 1 for point in prediction.points):
        return ()  # an unstable loop has no stationary noise
    return (
        f"the measured velocities have errors with a standard deviation of {present:.2g} m/s or rad/s; white noise "
        f"above {largest:.2g} alone drives the input to its limit",
    )


def _drift(prediction: Prediction) -> tuple[str, ...]:
    if prediction.drift is None or prediction.drift[0] < prediction.drift[1]:
        return ()
    added, breaks = prediction.drift
    bound = (
        "the weights are not bounded" if np.isinf(added) else f"the bounded weights can add a gain of {added:.3g} 1/s"
    )
    return (
        f"{bound}, and noise or a persistent load can drive them to a gain of {breaks:.3g} 1/s, at which the loop "
        "becomes unstable. Set `weights_bound`, or a smaller one",
    )
