"""Run a scenario."""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np

from undertow.analysis.metrics import Gathered
from undertow.core import runtime
from undertow.core.batch_compiler import Unsupported
from undertow.core.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built, build, in_its_precision
from undertow.scenario.consistency import record_period
from undertow.scenario.prepare import steady_accumulators
from undertow.scenario.reading import Text
from undertow.scenario.results.run_result import MetricsSettings, Origin, ScenarioResult, make_result
from undertow.scenario.schema import ClosedLoopSettings, Initial
from undertow.scenario.step_size import step_failure
from undertow.simulation.loop import continuous, sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.outcome import Outcome


def run_scenario(source: Text | Mapping[str, Any] | Built) -> ScenarioResult:
    """Run a scenario on the CPU: a single run has no work for a GPU.

    Args:
        source: a scenario, read, as data or built.

    Raises:
        BadInput: the scenario is invalid.
    """
    with runtime.on_processor():
        return _run(source if isinstance(source, Built) else build(source))


@in_its_precision
def _run(built: Built) -> ScenarioResult:
    scenario, gathered = built.scenario, gathered_of(built)
    outcome_and_reason = run_loop(built.closed_loop, scenario.loop, scenario.initial, scenario.seed, gathered)
    return finished(built, *outcome_and_reason, gathered)


def gathered_of(built: Built) -> Gathered:
    """What gathers the steady metrics along a run; () where the record is what counts."""
    if not built.scenario.steady.every_step:
        return ()
    return steady_accumulators(built)


@in_its_precision
def finished(built: Built, outcome: Outcome, left_to_xla: str, gathered: Gathered = ()) -> ScenarioResult:
    """The result of a run; for outcome and `left_to_xla` see `run_loop`."""
    scenario, loop = built.scenario, built.scenario.loop
    settings = MetricsSettings(
        built.window(),
        loop.dt,
        built.metrics,
        built.criterion(),
        gathered,
        built.requirements,
        record_period(loop),
        loop.duration,
    )
    title = scenario.description or "a closed loop run by undertow"
    why = step_failure(built.closed_loop, loop, outcome)
    origin = Origin(title, scenario.seed, built.resolved, built.code, left_to_xla, why or "")
    result = make_result(built.closed_loop, outcome, settings, origin)
    return ScenarioResult(result.series, result.facts, result.loop, result.outcome, built)


def run_loop(
    loop: ClosedLoop,
    settings: ClosedLoopSettings,
    start: Initial,
    seed: int,
    accumulators: tuple[sampled.AbstractAccumulator, ...] = (),
) -> tuple[Outcome, str]:
    """Run a closed loop with the keys `loop` and `initial` of a scenario; `accumulators` are for a sampled loop.

    Returns:
        The outcome, in NumPy arrays; and the reason why the SIMD backend could not be used, "" otherwise.
    """
    start_arrays = {key: None if value is None else np.asarray(value, dtype=float) for key, value in start}
    run_options: dict[str, Any] = {
        "duration": settings.duration,
        "dt": settings.dt,
        "key": key_of_seed(seed),
        **start_arrays,
    }
    compilers: tuple[Callable[..., Outcome], Callable[..., Outcome]]
    if settings.kind == "continuous":
        run_options |= {"record_step": settings.record}
        if settings.method == "adaptive":
            tolerances = (settings.rtol, settings.atol)
            return jax.device_get(continuous.simulate(loop, tolerances=tolerances, **run_options)), ""
        compilers = simd_batch.integrate, continuous.simulate
    else:
        run_options |= {
            "record_every": round(settings.record / settings.dt),
            "method": settings.method,
            "substeps": settings.substeps,
            "accumulators": accumulators,
        }
        compilers = simd_batch.simulate, sampled.simulate
    by_simd, by_xla = compilers
    lacking = ""
    if settings.backend == "simd":
        try:
            return jax.device_get(by_simd(loop, **run_options)), ""
        except Unsupported as error:
            lacking = str(error)
    return jax.device_get(by_xla(loop, **run_options)), lacking
