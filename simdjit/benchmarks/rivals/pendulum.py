"""The two problems on which tools are compared, for NumPy arrays of runs: a pendulum alone, and under a sampled law.

Both start at rest at angles from 0.1 to 2.5 rad and end after 10 s. The free pendulum has a closed form in elliptic
functions, so that errors are known. The sampled law holds a limited torque over 10 ms; its motion has no closed form
and is computed here with forty Runge-Kutta steps a sample, whose error is below 1e-12 rad.
"""

import numpy as np
from scipy.special import ellipj, ellipk

RUNS = 256
DURATION = 10.0  # s
STIFFNESS = 9.81  # 1/s^2: gravity over length
ANGLES = np.linspace(0.1, 2.5, RUNS)  # rad

SAMPLE = 0.01  # s
SAMPLES = round(DURATION / SAMPLE)
GAINS = 20.0, 6.0  # 1/s^2 and 1/s
LIMIT = 4.0  # rad/s^2


def alone() -> np.ndarray:
    """Angles of the free pendulum at the end, rad."""
    modulus = np.sin(ANGLES / 2)
    sine, *_ = ellipj(ellipk(modulus**2) - np.sqrt(STIFFNESS) * DURATION, modulus**2)
    return 2 * np.arcsin(modulus * sine)


def command(sine_of_t, angle, rate):
    """Torque of the law before its limit, which follows a sine of 1 rad; for numbers, or arrays of any library."""
    return -GAINS[0] * (angle - sine_of_t) - GAINS[1] * rate


def controlled() -> np.ndarray:
    """Angles of the controlled pendulum at the end, rad."""
    angle, rate, parts = ANGLES.copy(), np.zeros(RUNS), 40
    for k in range(SAMPLES):
        torque = np.clip(command(np.sin(k * SAMPLE), angle, rate), -LIMIT, LIMIT)
        for _ in range(parts):
            angle, rate = rk4(angle, rate, torque, SAMPLE / parts, np.sin)
    return angle


def rk4(angle, rate, torque, h, sine):
    """One Runge-Kutta step of h seconds, with the sine of any library."""
    pull = lambda angle: torque - STIFFNESS * sine(angle)
    a1 = pull(angle)
    r2, a2 = rate + h / 2 * a1, pull(angle + h / 2 * rate)
    r3, a3 = rate + h / 2 * a2, pull(angle + h / 2 * r2)
    r4, a4 = rate + h * a3, pull(angle + h * r3)
    return angle + h / 6 * (rate + 2 * r2 + 2 * r3 + r4), rate + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


ANSWERS = {"alone": alone, "controlled": controlled}
