"""C5: the modelling error as fuzzy input needs fewer rules than the state, and estimates better."""

from undertow.controllers.presets.paper import paper
from undertow.plants.double_integrator import double_integrator
from undertow.studies.paper.claims.finding import Finding, Runs, steady
from undertow.studies.paper.setup import scenario

CLAIM = "With the modelling error as input fewer rules are needed than with the state, and the estimate is better."

_ONE_RULE = "c05_one_rule"


def scenarios(quick: bool) -> dict:
    """The state as input, and (not when quick) a single rule, both with gamma matched to the same gamma |xi|^2."""
    matched = 100.0 * _gathering("error", 5)
    found = {
        "c05_state_matched": scenario(
            "RCAFC with the state as fuzzy input, gamma |xi|^2 as with the modelling error",
            controller={"fuzzy_input": "state", "adaptation": round(matched / _gathering("state", 5), 3)},
        )
    }
    one_rule = {
        _ONE_RULE: scenario(
            "RCAFC with a single fuzzy rule, gamma |xi|^2 as with five",
            controller={"sets": 1, "adaptation": round(matched, 3)},
        )
    }
    return found if quick else found | one_rule


def judge(runs: Runs) -> Finding:
    """Estimation error against number of rules and choice of input, gamma as printed and matched."""
    named = {
        "error_5_rules": "ideal_rcafc",
        "state_25_rules": "table2_rcafc_state",
        "state_25_rules_matched": "c05_state_matched",
        "error_1_rule": _ONE_RULE,
    }
    found = {key: steady(runs[name])["estimation_rms"] for key, name in named.items() if name in runs}
    text = (
        f"rms estimation error, m/s^2: modelling error with 5 rules {found['error_5_rules']:.3g}, state with 25 rules "
        f"{found['state_25_rules']:.3g} at the same gamma, {found['state_25_rules_matched']:.3g} at the same gamma "
        "|xi|^2. What differs is the loop gain, not the input."
    )
    if "error_1_rule" in found:
        text += f" A single rule, which is a plain integrator, does it too: {found['error_1_rule']:.3g}."
    if found["state_25_rules"] <= found["error_5_rules"]:
        return Finding("fails", text, "table2_rcafc_state", found)
    if found["state_25_rules_matched"] <= 1.05 * found["error_5_rules"]:
        return Finding("holds if gamma is the same; not at the same loop gain", text, "c05_state_matched", found)
    return Finding("holds", text, "table2_rcafc_state", found)


def _gathering(fuzzy_input: str, sets: int) -> float:
    law = paper(double_integrator(1).model(), fuzzy_input=fuzzy_input, sets=sets)
    return float(law.fuzzy.gathering())
