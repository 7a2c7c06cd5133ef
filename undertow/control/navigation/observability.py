"""What given sensors cannot observe, and how far the estimate drifts there: analysis of the covariance, without a run.

The vehicle is at rest and level, heading north, so that the errors follow a linear system with constant matrices. A
vehicle that manoeuvres observes more: its heading, for one, from position fixes and velocities.
"""

from typing import NamedTuple

import numpy as np

from undertow.physics.sensors.motion import gravity

_SIZE = 15  # errors of attitude, gyro bias, velocity, force bias, position; three each
_OUTPUTS = {"north": 12, "east": 13, "down": 14, "roll": 0, "pitch": 1, "yaw": 2}
_REMEDIES = {"north": "position_fix", "east": "position_fix", "down": "depth", "yaw": "compass"}
_NEGLIGIBLE = 1e-9  # share of a direction outside of what is observed
_STEPS = 2000  # of the covariance, at most


class Sensed(NamedTuple):
    """What one sensor tells of the errors: slopes [entries, 15], variance of each entry, and its period, s."""

    slopes: np.ndarray
    variance: np.ndarray
    period: float


def error_dynamics() -> np.ndarray:
    """Matrix A of e_dot = A e at rest: gravity turns an error of the attitude into one of the acceleration."""
    a, identity = np.zeros((_SIZE, _SIZE)), np.eye(3)
    g = float(gravity()[2])
    force = np.array([[0, g, 0], [-g, 0, 0], [0, 0, 0]])  # cross product with the specific force (0, 0, -g)
    a[0:3, 3:6] = -identity
    a[6:9, 0:3] = -force
    a[6:9, 9:12] = -identity
    a[12:15, 6:9] = identity
    return a


def unobservable(sensed: list[Sensed]) -> list[str]:
    """Outputs that no sensor determines, by the rank of the observability matrix."""
    a = error_dynamics()
    rows = np.concatenate([sensor.slopes for sensor in sensed]) if sensed else np.zeros((0, _SIZE))
    blocks = [rows]
    for _ in range(_SIZE - 1):
        blocks.append(blocks[-1] @ a)
    _, sizes, directions = np.linalg.svd(np.concatenate(blocks))
    observed = directions[: int((sizes > 1e-9 * max(1.0, sizes.max(initial=0.0))).sum())]
    return [name for name, i in _OUTPUTS.items() if 1 - (observed[:, i] ** 2).sum() > _NEGLIGIBLE]


def deviations(sensed: list[Sensed], initial: np.ndarray, noise: np.ndarray, duration: float) -> dict[str, float]:
    """Standard deviations of all outputs after a time at rest.

    Args:
        sensed: of each sensor.
        initial: standard deviations of the errors at the start, [15].
        noise: densities of the noise that drives the errors, [15], square of their unit per second.
        duration: s.

    Returns:
        Output -> m or rad.
    """
    step = max(0.02, duration / _STEPS)
    a = step * error_dynamics()
    after = np.eye(_SIZE) + a + a @ a / 2 + a @ a @ a / 6
    covariance, process_noise = np.diag(np.asarray(initial) ** 2), step * np.diag(noise)
    slopes = np.concatenate([sensor.slopes for sensor in sensed]) if sensed else np.zeros((0, _SIZE))
    # As much information per second as the readings have.
    variance = np.concatenate([sensor.variance * sensor.period / step for sensor in sensed]) if sensed else np.zeros(0)
    for _ in range(round(duration / step)):
        covariance = after @ covariance @ after.T + process_noise
        shared = covariance @ slopes.T
        covariance = covariance - shared @ np.linalg.solve(slopes @ shared + np.diag(variance), shared.T)
        covariance = (covariance + covariance.T) / 2
    return {name: float(np.sqrt(covariance[i, i])) for name, i in _OUTPUTS.items()}


def drift_sentences(sensed: list[Sensed], initial: np.ndarray, noise: np.ndarray, duration: float) -> tuple[str, ...]:
    """A sentence where an output is not observed, with how far it drifts in `duration` (s) and what prevents it."""
    unseen = unobservable(sensed)
    if not unseen:
        return ()
    deviation_of = deviations(sensed, initial, noise, duration)
    is_angle = lambda name: name in _OUTPUTS and _OUTPUTS[name] < 3
    sized = lambda name: (
        f"{np.degrees(deviation_of[name]):.2g} degrees" if is_angle(name) else f"{deviation_of[name]:.2g} m"
    )
    drift_text = ", ".join(f"{sized(name)} ({name})" for name in unseen)
    remedies = " and ".join(
        f"`{remedy}`" for remedy in dict.fromkeys(_REMEDIES[name] for name in unseen if name in _REMEDIES)
    )
    return (
        f"the sensors cannot observe {', '.join(unseen)} of a vehicle at rest: the estimate drifts by "
        f"about {drift_text} in {duration:g} s, one standard deviation"
        + (f". Add {remedies} to `navigation.sensors`" if remedies else ""),
    )
