"""A12: a model that is wrong."""

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_odin import loop

QUESTION = "How wrong may the model be?"
PREDICTION = "Very: every true gain of the right sign is stable in continuous time."
LONG = True
METRICS = ("tracking_rms", "estimation_rms", "uncertainty_rms")
LEFT_OUT = "shift of the centre of gravity, single entries of B"

_ERRORS = {
    "exact": {},
    "mass x 0.5": {"mass": (0.5, 0.5)},
    "mass x 2": {"mass": (2.0, 2.0)},
    "drag x 3": {"damping": (3.0, 3.0)},
    "weight x 0.8-1.2": {"restoring": (0.8, 1.2)},
    "thrust x 0.4": {"thrust": (0.4, 0.4)},
    "thrust x 2.5": {"thrust": (2.5, 2.5)},
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Table 1 and `robust`, fidelity `ideal`."""
    return tuple(
        Variant(f"{name}, {what}", f"ODIN, fidelity: ideal, parameter_error {what}", loop(law, errors=error))
        for name, law in {"Table 1": paper, "robust": robust}.items()
        for what, error in _ERRORS.items()
    )


def judge(found) -> Answer:
    """Worst error over that of the exact model."""
    worst = {}
    for law in ("Table 1", "robust"):
        ratio = {what: _ratio(found, law, what) for what in _ERRORS}
        worst[law] = max(ratio.items(), key=lambda pair: pair[1])
    ended = [name for name, one in found.items() if one.failures]
    text = "Largest error over that of the exact model: " + ", ".join(
        f"{law} {ratio:.3g} times ({what})" for law, (what, ratio) in worst.items()
    )
    text += f". Ended early: {'; '.join(ended) or 'none'}."
    return answer(not ended, text, partly=len(ended) <= 2)


def _ratio(found, law: str, what: str) -> float:
    return found[f"{law}, {what}"]["tracking_rms"] / found[f"{law}, exact"]["tracking_rms"]
