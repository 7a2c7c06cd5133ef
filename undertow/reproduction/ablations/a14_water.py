"""A14: current, waves, tether."""

from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_heavy import SCHEDULE, hand_tuned, loop, sound

QUESTION = "Do current, waves and a tether trouble it?"
PREDICTION = "No: all of it is slower than 10 rad/s."
LONG = True
METRICS = ("tracking_rms", "estimation_rms", "input_rms", "saturated_fraction")
LEFT_OUT = "payload pick-up, whose mass matrix is inverted at every step"

_WATER = {
    "calm": {},
    "current 0.5 m/s": {"current": 0.5},
    "waves 0.5 m": {"height": 0.5},
    "tether": {"current": 0.3, "cable": 4.0},
    "all": {"current": 0.3, "height": 0.5, "cable": 4.0},
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """The paper's law tuned by hand, and `robust` with no gain given."""
    laws = {"hand-tuned": (hand_tuned, {"rate_term": True}), "robust": (sound, {})}
    return tuple(
        Variant(f"{name}, {what}", f"BlueROV2 Heavy, 100 Hz, {what}", loop(law, **sea, **model), SCHEDULE)
        for name, (law, model) in laws.items()
        for what, sea in _WATER.items()
    )


def judge(found) -> Answer:
    """Errors."""
    text = []
    for law in ("hand-tuned", "robust"):
        errors = ", ".join(f"{what} {found[f'{law}, {what}']['tracking_rms']:.2g}" for what in _WATER)
        text.append(f"{law}, tracking rms: {errors}.")
    fine = all(one["tracking_rms"] < 0.1 and not one.failures for one in found.values())
    return answer(fine, " ".join(text))
