"""The closed loop as one linear discrete-time system, with optional delay, lag and gain between law and plant."""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy  # its parts are loaded when they are used

from undertow.analysis.linearization.equilibrium import Equilibrium
from undertow.analysis.linearization.jacobians import SIGNALS, Slopes

# Where something enters: a load (m/s^2, rad/s^2), errors of position and velocity, and an error of the input.
ENTRIES = ("load", "noise", "input")


class LinearLoop(NamedTuple):
    """s+ = A s + B w, q = C s + D w, from step to step.

    Attributes:
        matrix: A.
        entries: B by name, of `ENTRIES`: load (n), noise on position and velocity (2 n), error of the input (m).
        signals: C by name: u (m), and those of `SIGNALS` that the law has (n each).
        direct: D by name of signal and entry.
        dt: s.
    """

    matrix: np.ndarray
    entries: dict[str, np.ndarray]
    signals: dict[str, np.ndarray]
    direct: Slopes
    dt: float


def close_sampled(at: Equilibrium, dt: float, delay: float = 0.0, lag: float = 0.0, gain: float = 1.0) -> LinearLoop:
    """The sampled loop: the plant exactly between two steps with the input held, the law as it steps.

    Args:
        at: loop at rest; its slopes must have been taken with the same dt.
        dt: sampling time, s.
        delay: from the law to the actuators, unknown to the law, s; any fraction of dt.
        lag: of a further first-order actuator, unknown to the law, s.
        gain: by which the input's effect differs from what the law takes it for.
    """
    slopes, acting = at.local.slopes, at.acting
    state_matrix = slopes["plant"]["plant"][np.ix_(acting, acting)]
    push = gain * slopes["plant"]["u"][acting]
    load = slopes["plant"]["load"][acting]
    inputs, count = push.shape[1], len(state_matrix)
    if lag:
        state_matrix = np.block([[state_matrix, push], [np.zeros((inputs, count)), -np.eye(inputs) / lag]])
        load = np.vstack([load, np.zeros((inputs, load.shape[1]))])
        push = np.vstack([np.zeros((count, inputs)), np.eye(inputs) / lag])
    whole_steps, remainder = divmod(delay / dt, 1.0)
    buffered = int(whole_steps) + 1 if delay else 0
    step, early, late, loaded = _held(state_matrix, push, load, dt, remainder * dt)
    n, law = len(state_matrix), len(slopes["law"]["law"])
    states = n + law + buffered * inputs
    x, z = slice(0, n), slice(n, n + law)

    def of_state(name: str) -> np.ndarray:
        row = np.zeros((len(slopes[name]["law"]), states))
        row[:, :count], row[:, z] = slopes[name]["plant"][:, acting], slopes[name]["law"]
        return row

    u, u_noise = of_state("u"), slopes["u"]["noise"]
    matrix = np.zeros((states, states))
    sizes = {"load": load.shape[1], "noise": u_noise.shape[1], "input": inputs}
    entries = {name: np.zeros((states, size)) for name, size in sizes.items()}
    matrix[x, x], entries["load"][x] = step, loaded
    entries["input"][x] = early + late
    matrix[z] = of_state("law") + slopes["law"]["u"] @ u
    entries["noise"][z] = slopes["law"]["noise"] + slopes["law"]["u"] @ u_noise
    # A shift register holds the inputs that still wait. Within a step the older of two acts until the remainder of the
    # delay has passed (`early`), the newer one after it (`late`).
    slots = [slice(n + law + i * inputs, n + law + (i + 1) * inputs) for i in range(buffered)]  # newest first
    for share, steps in ((late, buffered - 1), (early, buffered)):
        if steps <= 0:
            matrix[x] += share @ u
            entries["noise"][x] += share @ u_noise
        else:
            matrix[x, slots[steps - 1]] += share
    if buffered:
        matrix[slots[0]], entries["noise"][slots[0]] = u, u_noise
    for newer, older in itertools.pairwise(slots):
        matrix[older, newer] = np.eye(inputs)
    return LinearLoop(matrix, entries, *_shown(slopes, of_state), dt)


def close_continuous(at: Equilibrium, dt: float) -> LinearLoop:
    """The loop as one differential equation, followed exactly over dt (s); law and input change all the time."""
    slopes, acting = at.local.slopes, at.acting
    of_state = lambda name: np.hstack([slopes[name]["plant"][:, acting], slopes[name]["law"]])
    u, u_noise = of_state("u"), slopes["u"]["noise"]
    push = np.vstack([slopes["plant"]["u"][acting], slopes["flow"]["u"]])
    state_matrix = np.vstack([of_state("plant")[acting], of_state("flow")])
    load = np.vstack([slopes["plant"]["load"][acting], slopes["flow"]["load"]])
    noise = np.vstack([slopes["plant"]["noise"][acting], slopes["flow"]["noise"]]) + push @ u_noise
    to_plant = np.vstack([slopes["plant"]["u"][acting], 0 * slopes["flow"]["u"]])
    step, *entered = _followed(state_matrix + push @ u, (load, noise, to_plant), dt)
    return LinearLoop(step, dict(zip(ENTRIES, entered, strict=True)), *_shown(slopes, of_state), dt)


def _shown(slopes: Slopes, of_state: Callable[[str], np.ndarray]) -> tuple[dict[str, np.ndarray], Slopes]:
    """Signals of the state, and what enters them directly; the input is what the law commands."""
    u, u_noise = of_state("u"), slopes["u"]["noise"]
    signals, direct = {"u": u}, {"u": {"load": slopes["u"]["load"], "noise": u_noise}}
    for name in filter(slopes.__contains__, SIGNALS):
        applied = slopes[name]["u"]
        signals[name] = of_state(name) + applied @ u
        direct[name] = {"load": slopes[name]["load"], "noise": slopes[name]["noise"] + applied @ u_noise}
    return signals, direct


def _held(state_matrix, push, load, dt: float, wait: float):
    """Transition over dt, effect of the input held before `wait` (s), of that after it, and of a held load."""
    step, held_effect, loaded = _followed(state_matrix, (push, load), dt)
    if not wait:
        return step, np.zeros_like(held_effect), held_effect, loaded
    _, late = _followed(state_matrix, (push,), dt - wait)
    return step, held_effect - late, late, loaded


def _followed(state_matrix: np.ndarray, entries: tuple[np.ndarray, ...], dt: float) -> list[np.ndarray]:
    """exp(A t), and the integrals of exp(A s) B from 0 to t, for each B."""
    n, wide = len(state_matrix), sum(entry.shape[1] for entry in entries)
    block = np.zeros((n + wide, n + wide))
    block[:n, :n], block[:n, n:] = state_matrix, np.hstack(entries)
    power = scipy.linalg.expm(block * dt)
    ends = np.cumsum([entry.shape[1] for entry in entries])[:-1]
    return [power[:n, :n], *np.split(power[:n, n:], ends, axis=1)]
