"""Gradient of the robustness: by differentiation through construction and run where possible, else by differences."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.analysis.linearization.jacobians import without
from undertow.analysis.temporal.formula import smooth
from undertow.analysis.temporal.requirements import smooth_robustness
from undertow.core import checks, runtime
from undertow.scenario.build import build_scenario
from undertow.scenario.part_cache import PartCache
from undertow.scenario.prepare import loop_run
from undertow.scenario.reading import key_path
from undertow.simulation.loop import sampled
from undertow.studies.campaign.build_trials import with_value
from undertow.studies.falsification.evaluator import Evaluator

_SHARPNESS = 40.0  # of the smooth robustness, whose unit is the share of a bound
_STEPS = ("resolution", "dead_zone")  # parameters that make a smooth function piecewise constant
_DIFFERENCE = 0.02  # of a coordinate, for differences
_COMPILER = {"xla_backend_optimization_level": "1"}  # compiling takes most of the time of a few gradients


class Gradient:
    """Gradient of the smallest robustness with respect to a departure.

    It is computed by forward differentiation where the loop can be built and run with traced numbers in the place of
    all that varies, all requirements are formulas, and there is one seed. Otherwise it is computed by differences of
    the exact robustness: where a delay varies, for example, which changes the size of a buffer.

    Args:
        evaluator: whose scenario it is.
        robustness: of departures, for differences; it counts the runs.
        differentiate: whether to differentiate at all.
    """

    def __init__(self, evaluator: Evaluator, robustness: Callable[[np.ndarray], np.ndarray], differentiate: bool):
        self._evaluator, self._robustness, self._box = evaluator, robustness, evaluator.box
        self._precision = evaluator.nominal.scenario.precision
        self._smallest = smooth_robustness(evaluator.requirements, smooth(_SHARPNESS))
        self.differentiated = differentiate and self._differentiable()
        self._compiled: Any = None

    def __call__(self, departure: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        """The gradient; zero where it is not finite."""
        slope = self._slope(departure) if self.differentiated else self._differences(departure)
        return np.where(np.isfinite(slope), slope, 0.0)

    def _slope(self, departure: np.ndarray) -> np.ndarray:
        with runtime.on_processor(), runtime.in_precision(self._precision):
            at = jnp.asarray(departure)
            if self._compiled is None:
                lowered = jax.jit(jax.jacfwd(self._smooth)).lower(at)
                self._compiled = lowered.compile(compiler_options=_COMPILER)  # pyright: ignore[reportArgumentType] - options of XLA
            return np.asarray(self._compiled(at))

    def _differences(self, departure: np.ndarray) -> np.ndarray:
        """Central differences, one-sided at a bound."""
        steps = _DIFFERENCE * np.eye(len(departure))
        ahead, behind = (np.clip(departure + s * steps, self._box.lower, self._box.upper) for s in (1.0, -1.0))
        values = self._robustness(np.concatenate([ahead, behind]))
        spans = np.diagonal(ahead - behind)
        return (values[: len(departure)] - values[len(departure) :]) / np.where(spans > 0, spans, np.inf)

    def _differentiable(self) -> bool:
        """Whether the loop can be built and run with traced numbers."""
        several_seeds = len(self._evaluator.seeds) > 1
        if self._smallest is None or several_seeds or any(axis.integer for axis in self._box.axes):
            return False
        try:
            with runtime.on_processor(), runtime.in_precision(self._precision):
                jax.eval_shape(self._smooth, jnp.zeros(len(self._box.axes)))
        except Exception:  # whatever a constructor, of a user's own too, does with numbers that are not known
            return False
        return True

    def _smooth(self, departure: Any) -> Any:
        """Smooth robustness at a departure, which may be traced."""
        nominal, smallest = self._evaluator.nominal, self._smallest
        assert smallest is not None  # see `_differentiable`
        scenario, settings = nominal.scenario, nominal.scenario.loop
        for index, axis in enumerate(self._box.axes):
            scenario = with_value(scenario, key_path(axis.key), axis.value(departure[index], jnp))
        with checks.recorded_conditions():  # inside the bounds; the exact runs show whether they are met
            run = loop_run(build_scenario(scenario, nominal.text, PartCache()))
        outcome = sampled.simulate(
            without(run.loop, _STEPS),
            duration=settings.duration,
            dt=settings.dt,
            key=run.key,
            position=run.start[0],
            velocity=run.start[1],
            record_every=round(settings.record / settings.dt),
            method=settings.method,
            substeps=settings.substeps,
        )
        return smallest(outcome.signals, self._evaluator.period)
