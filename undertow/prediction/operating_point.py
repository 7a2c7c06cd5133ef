"""Where a scenario's loop rests under its mean load, and the metrics of its run predicted from there."""

from typing import Any, NamedTuple

import jax
import numpy as np
from jax.flatten_util import ravel_pytree

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.closed_loop import LinearLoop
from undertow.analysis.linearization.disturbance_profile import DisturbanceProfile, disturbance_profile
from undertow.analysis.linearization.equilibrium import Equilibrium, equilibrium
from undertow.analysis.linearization.response import from_start, metrics_of, signals_within
from undertow.controllers.composite_law import RCAF
from undertow.controllers.robust.robust_law import RobustRCAF
from undertow.core.contracts import AbstractController
from undertow.scenario.build import Built

_HELD = "at fixed weights"
_MAX_STEPS = 200_000  # that are predicted one by one


class OperatingPoint(NamedTuple):
    """A scenario's loop where it rests under its mean load, and what acts on it."""

    built: Built
    around: DisturbanceProfile
    mean: Equilibrium
    linear: LinearLoop
    radius: float  # spectral radius of `linear`


def operating_point(built: Built) -> OperatingPoint:
    """Where the loop of a scenario rests under the mean load of its steady window, and its linearisation there.

    Raises:
        BadInput: its slopes are not finite there.
    """
    loop, settings = built.closed_loop, built.scenario.loop
    start, stop = built.window()
    position = np.asarray(loop.reference.at((start + min(stop, settings.duration)) / 2).position)
    calm = equilibrium(loop, settings.dt, position, np.zeros(len(position)))
    steps = min(round(settings.duration / settings.dt) + 1, _MAX_STEPS)
    around = disturbance_profile(loop, calm, jax.random.PRNGKey(built.scenario.seed), steps, settings.dt)
    inside = (around.time >= start) & (around.time <= stop)
    load = around.load[inside if inside.any() else slice(None)].mean(axis=0)
    mean = equilibrium(loop, settings.dt, position, load)
    linear = margins.closed(mean, settings.dt, settings.kind)
    return OperatingPoint(built, around, mean, linear, margins.spectral_radius(linear))


def predicted(known: OperatingPoint) -> tuple[dict[str, float] | None, str]:
    """Metrics of the steady window by the linearised loop; or None, and why."""
    if not known.mean.found:
        return None, f"no input holds the mean load: something still moves at {known.mean.moving:.2g} per second"
    if known.radius >= 1:
        pole = margins.poles(known.linear)[0]
        moving = "; weights that move apart may change that, which only a run tells" if has_weights(known.built) else ""
        return (
            None,
            f"the loop linearised {_HELD} is unstable: rightmost pole {pole.real:+.3g} {_turning(pole)}1/s{moving}",
        )
    start, stop = known.built.window()
    settings = known.built.scenario.loop
    every = max(1, round(settings.record / settings.dt))
    begun = from_start(known.linear, known.mean, *_start(known))
    signals = signals_within(known.mean, begun, known.around, (start, stop), every)
    forbidden = _forbidden(known.built.closed_loop.controller, signals)
    units = known.built.closed_loop.plant.output_units
    return (None, forbidden) if forbidden else (metrics_of(signals, units), "")


def has_weights(built: Built) -> bool:
    """Whether the law has several fuzzy weights per axis, of which a linearisation sees the present ones only."""
    law = built.closed_loop.controller
    return isinstance(law, RCAF) and law.fuzzy.rules > 1


def _forbidden(law: AbstractController, signals: dict[str, np.ndarray]) -> str:
    """What of the predicted signals the law itself would not allow, in a sentence; empty where all is allowed."""
    bounds: dict[str, tuple[str, Any]] = {}
    if isinstance(law, RCAF | RobustRCAF):
        weights = law.weights_bound if isinstance(law, RCAF) else law.estimator.bound
        bounds = {"robust_term": ("robust term", law.robust_gain), "estimate": ("estimate", weights)}
    for name, (meaning, bound) in bounds.items():
        share = np.abs(signals[name]) / np.maximum(np.asarray(bound, dtype=float), 1e-300)
        if share.max() > 1 and np.abs(signals[name]).max() > 0:
            row, axis = np.unravel_index(share.argmax(), share.shape)
            limit = np.broadcast_to(np.asarray(bound, dtype=float), share.shape[1:])[axis]
            asked = f"the linear model asks for a {meaning} of {abs(signals[name][row, axis]):.3g}"
            return f"{asked}, which the law bounds to {limit:.3g}: the loop does not stay where it is linear"
    return ""


def _start(known: OperatingPoint) -> list[np.ndarray]:
    """States of plant and law at t = 0 as vectors."""
    loop, initial = known.built.closed_loop, known.built.scenario.initial
    outputs = loop.outputs_at_start(initial.position, initial.velocity)
    realization = loop.realize(jax.random.PRNGKey(known.built.scenario.seed))
    return [np.asarray(ravel_pytree(state)[0]) for state in realization.start(*outputs)]


def _turning(pole: complex) -> str:
    return f"+- {abs(pole.imag):.3g}j " if pole.imag else ""
