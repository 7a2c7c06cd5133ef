"""A17: fewer thrusters."""

from undertow.controllers.presets.paper import paper
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_odin import loop

QUESTION = "What with fewer than eight thrusters?"
PREDICTION = "Six independent ones do; below rank 6 there are directions in open loop."
LONG = True
METRICS = ("lost_axes", "tracking_rms", "input_rms")

_FITTED = {
    8: None,
    6: (1, 2, 3, 5, 6, 7),
    5: (1, 2, 3, 5, 6),
    4: (5, 6, 7, 8),
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Table 1, fidelity `ideal`; four are all of one plane."""
    chosen = (8, 6) if quick else tuple(_FITTED)
    return tuple(
        Variant(f"N = {count}", f"thrusters: {_FITTED[count] or 'all'}", loop(paper, thrusters=_FITTED[count]))
        for count in chosen
    )


def judge(found) -> Answer:
    """Axes that are not held to 0.1 m or rad."""
    lost = {name: one["lost_axes"] for name, one in found.items()}
    text = "Axes off by more than 0.1 m or rad, median: " + ", ".join(f"{k}: {v:g}" for k, v in lost.items()) + "."
    whole = lost["N = 8"] == lost["N = 6"] == 0
    return answer(whole and all(lost.get(f"N = {n}", 1) > 0 for n in (5, 4)), text, partly=whole)
