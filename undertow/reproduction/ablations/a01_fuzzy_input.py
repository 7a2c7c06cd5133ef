"""A1: the modelling error or the state as fuzzy input."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_axes import basis_norm_squared, loop

QUESTION = "Modelling error or state as fuzzy input?"
PREDICTION = "At equal gamma the state is worse by the ratio of |xi|^2; at equal gamma |xi|^2 they are the same."
LONG = True
METRICS = ("estimation_rms", "tracking_rms")
LEFT_OUT = "loads that repeat with position, which only the state could learn"

_MATCHED = 100.0 * basis_norm_squared() / basis_norm_squared(fuzzy_input="state")


def variants(quick: bool) -> tuple[Variant, ...]:
    """Table 1 with either input."""
    by_state = partial(paper, fuzzy_input="state")
    return (
        Variant("error", "Table 1", loop(paper)),
        Variant("state", "fuzzy_input: state", loop(by_state)),
        Variant(
            "state, matched",
            f"fuzzy_input: state, adaptation: {_MATCHED:.4g}",
            loop(partial(by_state, adaptation=_MATCHED)),
        ),
    )


def judge(found) -> Answer:
    """Ratios of the estimation error."""
    ratio = {name: one["estimation_rms"] / found["error"]["estimation_rms"] for name, one in found.items()}
    same, more = ratio["state, matched"], ratio["state"]
    text = f"State: {more:.2f} times the error at equal gamma, {same:.3f} times at equal gamma |xi|^2."
    return answer(abs(same - 1) < 0.05 and more > 1.2, text, partly=abs(same - 1) < 0.05)
