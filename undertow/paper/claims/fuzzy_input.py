"""C5: the modelling error as fuzzy input needs fewer rules than the state, and estimates better."""

from typing import Any

from undertow.paper.claims.finding import ClaimVerdict, Runs, claim, steady
from undertow.paper.horizons import Long, sampled
from undertow.paper.running import BatchedRun
from undertow.paper.setup import FIDELITIES, same_loop_gain, scenario

# Law -> words, options; all with the same gamma |xi|^2.
_LAWS: dict[str, tuple[str, dict[str, Any]]] = {
    "error_5": ("modelling error, 5 rules", {}),
    "error_1": ("modelling error, 1 rule", same_loop_gain("error", 1)),
    "state_25": ("state, 25 rules", same_loop_gain("state", 5)),
}

_AS_GOOD = 1.05  # times the estimation error


def _fuzzy_input_batched(quick: bool) -> dict:
    """The state, one rule and five rules at every fidelity level, at the same loop gain."""
    return {
        _name(level, law): scenario(
            f"Table 1 at fidelity {level}, fuzzy input: {words}, the same gamma |xi|^2",
            fidelity=level,
            controller=options | {"weights_bound": float("inf")},
            disturbance={"kind": "u2"},  # which is U1 for 20 s
            loop=sampled(20.0),
        )
        for level in (FIDELITIES[2:3] if quick else FIDELITIES)
        for law, (words, options) in _LAWS.items()
    }


@claim(
    "C5",
    "With the modelling error as input fewer rules are needed than with the state, and the estimate is better.",
    batched=_fuzzy_input_batched,
)
def fuzzy_input(runs: Runs, long: Long) -> ClaimVerdict:
    """Estimation error and chattering at every fidelity level; at the printed gamma at `ideal`."""
    same_gamma = steady(runs["table2_rcafc_state"])["estimation_rms"], steady(runs["ideal_rcafc"])["estimation_rms"]
    levels = [level for level in FIDELITIES if _name(level, "error_5") in long]
    by_level = {level: {law: _metrics(long[_name(level, law)]) for law in _LAWS} for level in levels}
    sentences = []
    for level in levels:
        of_laws = [f"{_LAWS[law][0]} {_shown(long[_name(level, law)])}" for law in _LAWS]
        sentences.append(f"{level}: {'; '.join(of_laws)}")
    text = (
        f"At the same gamma the state has {same_gamma[0] / same_gamma[1]:.2g} times the estimation error at ideal, "
        "since its loop gain is smaller. At the same loop gain, rms estimation error in m/s^2 and chattering "
        f"from 10 s to 20 s of U1, 1 kHz: {'. '.join(sentences)}."
    )
    numbers = {"same_gamma": list(same_gamma), "levels": by_level}
    simulated = f"levels {', '.join(levels)}, U1 at 1 kHz, 20 s"
    equal_levels, better_levels = [], []
    for level, laws in by_level.items():
        five_sets = laws["error_5"]
        alternatives = [laws["error_1"], laws["state_25"]]
        if five_sets is None:
            continue
        limit = _AS_GOOD * five_sets["estimation_rms"]
        as_good = [bool(metrics) and metrics["estimation_rms"] <= limit for metrics in alternatives]
        if all(as_good):
            equal_levels.append(level)
        elif not any(as_good):
            better_levels.append(level)
    if not better_levels:
        return ClaimVerdict("fails", text, _name(levels[0], "state_25"), simulated, numbers)
    verdict = f"holds if the thruster lags (level {' and '.join(better_levels)}) and with five sets, not one"
    verdict += f"; at the same loop gain it makes no difference at {' and '.join(equal_levels)}" if equal_levels else ""
    return ClaimVerdict(verdict, text, _name(better_levels[0], "error_1"), simulated, numbers)


def _name(level: str, law: str) -> str:
    return f"c05_{level}_{law}"


def _metrics(run: BatchedRun) -> dict[str, float] | None:
    metrics = run.windows[0]
    return metrics and {metric: metrics[metric] for metric in ("tracking_rms", "estimation_rms", "input_variation")}


def _shown(run: BatchedRun) -> str:
    metrics = _metrics(run)
    if metrics is None:
        return f"ends at {run.ended:.2g} s"
    return f"{metrics['estimation_rms']:.3g} ({metrics['input_variation']:.3g} V/s)"
