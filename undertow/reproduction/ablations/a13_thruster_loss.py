"""A13: thrusters that fail unannounced."""

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_odin import loop

QUESTION = "What if thrusters fail and nobody is told?"
PREDICTION = "Any loss that keeps rank 6 is borne (one always, two in 16 of 28 pairs, three never); a reversed one not."
LONG = True
METRICS = ("tracking_rms", "estimation_rms", "input_rms")
LEFT_OUT = "thrusters that are stuck at a thrust"

_LOSSES = {
    "none": (1.0, 0.0),
    "one half": (0.5, 1.0),
    "one off": (0.0, 1.0),
    "two off": (0.0, 2.0),
    "three off": (0.0, 3.0),
    "one reversed": (-1.0, 1.0),
}
_LOST = 0.1  # m, rad


def variants(quick: bool) -> tuple[Variant, ...]:
    """Table 1 and `robust`, fidelity `ideal`; which thrusters fail, at 2 s, is drawn for every seed."""
    return tuple(
        Variant(f"{name}, {what}", f"ODIN, fidelity: ideal, {what} from 2 s", loop(law, loss=loss))
        for name, law in {"Table 1": paper, "robust": robust}.items()
        for what, loss in _LOSSES.items()
    )


def judge(found) -> Answer:
    """Median errors and early ends."""
    text = []
    for law in ("Table 1", "robust"):
        errors = [f"{what} {found[f'{law}, {what}']['tracking_rms']:.2g}" for what in _LOSSES]
        text.append(f"{law}, median tracking rms: {', '.join(errors)}.")
    single = all(found[f"{law}, one off"]["tracking_rms"] < _LOST for law in ("Table 1", "robust"))
    high = all(found[f"{law}, one off"].metrics["tracking_rms"].high < _LOST for law in ("Table 1", "robust"))
    triple = all(not found[f"{law}, three off"]["tracking_rms"] < _LOST for law in ("Table 1", "robust"))
    return answer(single and high and triple, " ".join(text), partly=single)
