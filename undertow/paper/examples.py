"""The paper's two examples, Table 2 in numbers, and every fidelity level: scenarios and reported numbers."""

from collections.abc import Mapping
from typing import Any

from undertow.analysis.drift import gain_of
from undertow.analysis.motor_loop import motor_matrix, rightmost
from undertow.core.status import Status
from undertow.paper.all_outputs import with_all_outputs
from undertow.paper.setup import CONTROLLERS, FIDELITIES, law_of, motor_of, scenario
from undertow.scenario.results.run_result import ScenarioResult

# Propeller speeds at which the loop is linearised, rad/s: Section 3.9 of the theory, 6 to 90 N of thrust.
_SPEEDS = (2.0, 10.0, 20.0, 40.0, 60.0)


def scenarios() -> dict[str, dict[str, Any]]:
    """Every run of this part, by name."""
    plain = {
        f"{fidelity}_{name}": scenario(f"{name.upper()} at fidelity {fidelity}", fidelity=fidelity, composite=composite)
        for fidelity in FIDELITIES
        for name, composite in CONTROLLERS.items()
    }
    return plain | {
        f"table2_{name}_state": scenario(
            f"{name.upper()} with the state as fuzzy input", composite=composite, controller={"fuzzy_input": "state"}
        )
        for name, composite in CONTROLLERS.items()
    }


def example(runs: Mapping[str, ScenarioResult], number: int) -> dict[str, Any]:
    """Metrics of Example 1 (fidelity `ideal`) or 2 (fidelity `static`) for both controllers."""
    fidelity = FIDELITIES[number - 1]
    return {name: _metrics(runs[f"{fidelity}_{name}"]) for name in CONTROLLERS}


def table2(runs: Mapping[str, ScenarioResult]) -> dict[str, Any]:
    """Table 2 in numbers: both controllers with the modelling error or the state as fuzzy input."""
    table = {}
    for name in CONTROLLERS:
        table[f"{name}_error"] = _metrics(runs[f"ideal_{name}"])
        table[f"{name}_state"] = _metrics(runs[f"table2_{name}_state"])
    return table


def fidelity(runs: Mapping[str, ScenarioResult]) -> dict[str, Any]:
    """Both controllers at Table 1 gains at every fidelity level: how each run ended, when and why."""
    by_level = {}
    for level in FIDELITIES:
        runs_of_level = {name: runs[f"{level}_{name}"] for name in CONTROLLERS}
        by_level[level] = {name: _metrics(run) | {"why": _why(run, level)} for name, run in runs_of_level.items()}
    return by_level


def _metrics(run: ScenarioResult) -> dict[str, Any]:
    failed = run.status is not Status.OK
    return {
        "status": run.status.word,
        "diverged_at": float(run.outcome.ended) if failed else None,
        "simulated_s": float(run.outcome.ended),
        "steady": with_all_outputs(run.steady),
        "whole": with_all_outputs(run.whole),
    }


def _why(run: ScenarioResult, fidelity: str) -> str:
    if fidelity == "ideal":
        return "Thrust follows voltage without lag, as the theory assumes."
    if fidelity == "static":
        return "The motor's curve is part of d, but without lag: the estimator treats it as a further disturbance."
    law, motor = law_of(run), motor_of(run)
    winding = fidelity == "electromechanical"
    modes = [rightmost(motor_matrix(law, motor, speed, winding)) for speed in _SPEEDS]
    growth = [mode.real for mode in modes]
    # Both are statements about small motion at the initial weights; weights that drift add damping.
    worst = max(range(len(_SPEEDS)), key=growth.__getitem__)
    at = f"at a propeller speed of {_SPEEDS[worst]:g} rad/s"
    if growth[worst] < 0:
        return (
            f"At fixed weights the linearised loop is stable from 2 to 60 rad/s: rightmost eigenvalue "
            f"{growth[worst]:+.2f} 1/s {at}. This does not cover weights that drift: see the long runs."
        )
    number = sum(value > 0 for value in growth)
    rate = f"{growth[worst]:+.1f} 1/s, {abs(modes[worst].imag):.0f} rad/s, {at}"
    tail = "The oscillation grows until the run fails."
    if run.status is Status.OK:
        damping = gain_of(law, run.dataset["weights"].values[-1]).max()
        tail = (
            "The oscillation makes the weights drift apart, which adds damping (d_hat = z - c eps, c up to "
            f"{damping:.0f} 1/s at the end), until the oscillation stops growing: see below."
        )
    return (
        f"At fixed weights the linearised loop is unstable at {number} of {len(_SPEEDS)} speeds (worst {rate}). {tail}"
    )
