"""C5: the modelling error as fuzzy input needs fewer rules than the state, and estimates better."""

from undertow.controllers.rcaf import rcaf
from undertow.plants.double_integrator import double_integrator
from undertow.studies.paper.claims.finding import Finding, Runs, steady
from undertow.studies.paper.setup import scenario

CLAIM = "With the modelling error as input fewer rules are needed than with the state, and the estimate is better."


def scenarios(quick: bool) -> dict:
    """One rule, and the state as input with gamma matched to the same gamma |xi|^2."""
    table1 = 100.0
    one = round(table1 * _gathering("error", 5), 3)
    state = round(table1 * _gathering("error", 5) / _gathering("state", 5), 3)
    return {
        "c05_one_rule": scenario(
            "RCAFC with a single fuzzy rule, gamma |xi|^2 as with five", controller={"sets": 1, "adaptation": one}
        ),
        "c05_state_matched": scenario(
            "RCAFC with the state as fuzzy input, gamma |xi|^2 as with the modelling error",
            controller={"fuzzy_input": "state", "adaptation": state},
        ),
    }


def judge(runs: Runs) -> Finding:
    """Estimation error against number of rules and choice of input, gamma as printed and matched."""
    named = {
        "error_5_rules": "ideal_rcafc",
        "error_1_rule": "c05_one_rule",
        "state_25_rules": "table2_rcafc_state",
        "state_25_rules_matched": "c05_state_matched",
    }
    found = {key: steady(runs[name])["estimation_rms"] for key, name in named.items()}
    text = (
        f"rms estimation error, m/s^2: modelling error with 5 rules {found['error_5_rules']:.3g}, state with 25 rules "
        f"{found['state_25_rules']:.3g} at the same gamma. At the same gamma |xi|^2 one rule (a plain integrator) "
        f"gives {found['error_1_rule']:.3g} and the state {found['state_25_rules_matched']:.3g}: what "
        "differs is the loop gain, not the input."
    )
    if found["state_25_rules"] <= found["error_5_rules"]:
        return Finding("fails", text, "table2_rcafc_state", found)
    if found["state_25_rules_matched"] <= 1.05 * found["error_5_rules"]:
        return Finding("holds if gamma is the same; not at the same loop gain", text, "c05_state_matched", found)
    return Finding("holds", text, "table2_rcafc_state", found)


def _gathering(fuzzy_input: str, sets: int) -> float:
    law = rcaf(double_integrator(1).model(), fuzzy_input=fuzzy_input, sets=sets)
    return float(law.fuzzy.gathering())
