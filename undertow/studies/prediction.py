"""What will happen, before anything is run: a scenario's loop linearised about where it rests, and driven."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.flatten_util import ravel_pytree

from undertow.analysis.linearised import margins
from undertow.analysis.linearised.closed_forms import ClosedForm, closed_form_poles, drift_bound, estimator, ramp_error
from undertow.analysis.linearised.closing import LinearLoop
from undertow.analysis.linearised.forecast import forecast, from_start
from undertow.analysis.linearised.reach import Reach, reach
from undertow.analysis.linearised.rest import Rest, rest
from undertow.analysis.linearised.surroundings import Surroundings, surroundings
from undertow.plants.reachability import open_loop_advice
from undertow.scenario.build import Built

# Loads at which the loop is looked at: larger than these shares of all that act along the reference.
SHARES = (0.1, 0.5, 0.9)

_MOST_TICKS = 200_000  # that are foretold one by one
_SLOWEST, _LONGEST = 1e-2, 10.0  # rad/s and s: how far frequencies and margins are searched
_HIGHEST = 1.0  # frequency times sampling time: a third of what sampling can tell apart
_NOISE = 0.01  # m/s and rad/s, for gains per unit of noise
_DEVIATIONS = 3.0  # of noise that must fit between the input at rest and its limit

Progress = Callable[[str, float], None]


class Ground(NamedTuple):
    """A scenario's loop where it rests under its mean load, and what acts on it."""

    built: Built
    around: Surroundings
    mean: Rest
    linear: LinearLoop
    radius: float  # spectral radius of `linear`


class Point(NamedTuple):
    """One operating point."""

    share: float  # of all loads that are smaller
    load: np.ndarray  # m/s^2, rad/s^2
    u: np.ndarray  # that holds it
    used: float  # largest |u| as a share of its limit; 0 without a limit
    found: bool  # whether there is such an input
    poles: np.ndarray  # 1/s
    radius: float  # spectral radius from tick to tick; below 1 it is stable


class Noise(NamedTuple):
    """White noise on the measured velocities, new at every tick."""

    of_input: np.ndarray  # standard deviation per m/s or rad/s of noise
    of_estimate: np.ndarray  # 1/s
    largest: float  # noise, m/s and rad/s, whose threefold effect still fits into the limits of the input


class Prediction(NamedTuple):
    """All that `undertow analyze` says."""

    ground: Ground
    points: tuple[Point, ...]
    margins: dict[str, float]  # of the point that is nearest to instability
    noise: Noise
    frequency: np.ndarray  # rad/s
    error: np.ndarray  # |e / d| of each axis, (frequencies, axes); s^2
    estimation: np.ndarray  # |d_hat - d| / |d|, likewise
    forms: list[ClosedForm]
    estimators: list[tuple[str, float, float, float | None]]  # axis, w_o rad/s, zeta, |d_til| per |d_dot| s
    drift: tuple[float, float] | None  # largest gain that weights in their box add, and the one that breaks, 1/s
    reach: Reach
    lost: tuple[str, ...]
    metrics: dict[str, float] | None  # of the steady window
    why_not: str  # a sentence where there are none


def ground(built: Built) -> Ground:
    """Where the loop of a scenario rests under the mean load of its steady window, and its linearisation there."""
    loop, settings = built.closed_loop, built.scenario.loop
    start, stop = built.window()
    position = np.asarray(loop.reference.at((start + min(stop, settings.duration)) / 2).position)
    calm = rest(loop, settings.dt, position, np.zeros(len(position)))
    ticks = min(round(settings.duration / settings.dt) + 1, _MOST_TICKS)
    around = surroundings(loop, calm, jax.random.PRNGKey(built.scenario.seed), ticks, settings.dt)
    inside = (around.time >= start) & (around.time <= stop)
    load = around.load[inside if inside.any() else slice(None)].mean(axis=0)
    mean = rest(loop, settings.dt, position, load)
    linear = margins.closed(mean, settings.dt, settings.kind)
    return Ground(built, around, mean, linear, margins.spectral_radius(linear))


def foretold(known: Ground) -> tuple[dict[str, float] | None, str]:
    """Metrics of the steady window by the linearised loop; or None, and why."""
    if not known.mean.found:
        return None, f"no input holds the mean load: something still moves at {known.mean.moving:.2g} per second"
    if known.radius >= 1:
        pole = margins.poles(known.linear)[0]
        return None, f"the linearised loop is unstable: rightmost pole {pole.real:+.3g} {_turning(pole)}1/s"
    start, stop = known.built.window()
    settings = known.built.scenario.loop
    every = max(1, round(settings.record / settings.dt))
    begun = from_start(known.linear, known.mean, *_start(known))
    return forecast(known.mean, begun, known.around, (start, stop), every), ""


def predict(built: Built, progress: Progress = lambda message, share: None) -> Prediction:
    """Everything that can be said of a scenario before it is run.

    Args:
        built: the scenario.
        progress: told a message and the share done.
    """
    progress("where the loop rests", 0.0)
    known = ground(built)
    loop, settings = built.closed_loop, built.scenario.loop
    progress("poles at its operating points", 0.5)
    points = tuple(_point(known, *each) for each in zip(SHARES, known.around.operating_loads(SHARES), strict=True))
    nearest = max(points, key=lambda point: point.radius)
    worst = rest(loop, settings.dt, known.mean.parts.target.position, nearest.load)
    progress("margins", 0.6)
    bears = _margins(worst, settings.dt)
    progress("noise and disturbances", 0.9)
    frequency = np.geomspace(_SLOWEST, _HIGHEST / settings.dt, 300)
    error, estimation = _responses(known.linear, frequency)
    law, names = loop.controller, loop.plant.outputs
    metrics, why_not = foretold(known)
    axes = range(len(names))
    gains = np.asarray(law.model.gain(loop.plant.output(0.0, worst.parts.states(worst.at)[0])))
    return Prediction(
        ground=known,
        points=points,
        margins=bears,
        noise=_noise(known),
        frequency=frequency,
        error=error,
        estimation=estimation,
        forms=closed_form_poles(law, margins.poles(known.linear), names),
        estimators=[(names[i], *found, ramp_error(law, i)) for i in axes if (found := estimator(law, i))],
        drift=max((found for i in axes if (found := drift_bound(law, i, settings.dt))), default=None),
        reach=reach(loop, known.mean, known.around.load),
        lost=open_loop_advice("the gain matrix", gains, names),
        metrics=metrics,
        why_not=why_not,
    )


def _start(known: Ground) -> list[np.ndarray]:
    """States of plant and law at t = 0 as vectors."""
    loop, initial = known.built.closed_loop, known.built.scenario.initial
    outputs = loop.outputs_at_start(initial.position, initial.velocity)
    drawn = loop.draw(jax.random.PRNGKey(known.built.scenario.seed))
    return [np.asarray(ravel_pytree(state)[0]) for state in drawn.start(*outputs)]


def _point(known: Ground, share: float, load: np.ndarray) -> Point:
    loop, settings = known.built.closed_loop, known.built.scenario.loop
    at = rest(loop, settings.dt, known.mean.parts.target.position, load)
    linear = margins.closed(at, settings.dt, settings.kind)
    low, high = _limits(known.built, at)
    used = np.abs(at.at["u"]) / np.where(at.at["u"] < 0, -low, high)
    return Point(
        share, load, at.at["u"], float(used.max()), at.found, margins.poles(linear), margins.spectral_radius(linear)
    )


def _margins(at: Rest, dt: float) -> dict[str, float]:
    low, high = margins.gain_range(at, dt)
    return {
        "sampling_time": margins.largest_sampling_time(at, dt, _LONGEST),
        "delay": margins.largest_delay(at, dt, _LONGEST),
        "lag": margins.largest_lag(at, dt, _LONGEST),
        "gain_low": low,
        "gain_high": high,
    }


def _noise(known: Ground) -> Noise:
    dt, axes = known.linear.dt, known.around.load.shape[1]
    sampled = margins.closed(known.mean, dt)
    one = np.concatenate([np.zeros(axes), np.full(axes, _NOISE)])
    of_input, of_estimate = (margins.noise_gain(sampled, name, one) / _NOISE for name in ("u", "estimate"))
    low, high = _limits(known.built, known.mean)
    room = np.minimum(high - known.mean.at["u"], known.mean.at["u"] - low)
    with np.errstate(divide="ignore"):
        largest = float(np.maximum(room / (_DEVIATIONS * of_input), 0.0).min())
    return Noise(of_input, of_estimate, largest)


def _limits(built: Built, at: Rest) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest input that reaches the actuators."""
    plant, (x, _) = built.closed_loop.plant, at.parts.states(at.at)
    ask = np.full(plant.inputs(), 1e9)
    low, high = (np.asarray(plant.admissible(x, side * ask)) for side in (-1, 1))
    return np.where(low < -1e8, -np.inf, low), np.where(high > 1e8, np.inf, high)


def _responses(linear: LinearLoop, frequency: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """|e / d| of each output, and |d_hat - d| / |d| of each axis of the law, under a load on the same axis."""
    answer = {name: margins.response(linear, name, frequency) for name in ("error", "estimate", "uncertainty")}
    into_axes = linear.direct["uncertainty"]["load"]  # a load on the outputs as the law sees it
    missed = (answer["estimate"] - answer["uncertainty"]) @ np.linalg.inv(into_axes)
    own = lambda matrices: np.abs(np.diagonal(matrices, axis1=1, axis2=2))
    return own(answer["error"]), own(missed)


def _turning(pole: complex) -> str:
    return f"+- {abs(pole.imag):.3g}j " if pole.imag else ""


def summary(prediction: Prediction) -> dict[str, Any]:
    """What stands in prediction.json."""
    known = prediction.ground
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
        "reach": {
            "low": prediction.reach.low.tolist(),
            "high": prediction.reach.high.tolist(),
            "demand": prediction.reach.demand.tolist(),
            "held": prediction.reach.held,
            "smallest_share": float(prediction.reach.share.min()),
        },
        "uncontrollable": list(prediction.lost),
        "metrics": prediction.metrics,
        "why_no_metrics": prediction.why_not,
    }
