"""A15: moving references."""

import math

from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_heavy import SCHEDULE, hand_tuned, loop, sound

QUESTION = "Does it follow what moves, through steep pitch and past a heading of 180 deg?"
PREDICTION = "Euler angles fail near a pitch of 90 deg; a law in body axes does not."
LONG = True
METRICS = ("tracking_rms", "estimation_rms", "input_rms")
LEFT_OUT = "errors are told in Euler angles, which exaggerates them at steep pitch"

_REFERENCES = {
    "slow": {"swing": (1.0, 1.0, 0.5, 0.0, 0.0, 0.5), "rate": 0.3},
    "fast": {"swing": (0.5, 0.5, 0.3, 0.0, 0.0, 0.5), "rate": 1.0},
    "pitch to 60 deg": {"swing": (0.0, 0.0, 0.0, 0.0, math.radians(60), 0.0)},
    "pitch to 85 deg": {"swing": (0.0, 0.0, 0.0, 0.0, math.radians(85), 0.0)},
    "past 180 deg": {"swing": (0.0, 0.0, 0.0, 0.0, 0.0, 1.0), "middle": (0.0, 0.0, 0.0, 0.0, 0.0, math.pi)},
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """The paper's law tuned by hand, and `robust` with no gain given."""
    laws = {"hand-tuned": (hand_tuned, {"rate_term": True}), "robust": (sound, {})}
    return tuple(
        Variant(f"{name}, {what}", f"BlueROV2 Heavy, 100 Hz, {what}", loop(law, **way, **model), SCHEDULE)
        for name, (law, model) in laws.items()
        for what, way in _REFERENCES.items()
    )


def judge(found) -> Answer:
    """Errors and early ends."""
    text = []
    for law in ("hand-tuned", "robust"):
        said = ", ".join(f"{what} {_end(found[f'{law}, {what}'])}" for what in _REFERENCES)
        text.append(f"{law}, tracking rms: {said}.")
    steep = "pitch to 85 deg"
    robust_fine = all(found[f"robust, {what}"].failures == 0 for what in _REFERENCES)
    return answer(robust_fine and found[f"hand-tuned, {steep}"].failures > 0, " ".join(text), partly=robust_fine)


def _end(one) -> str:
    return f"{one.failures} of {one.seeds} end early" if one.failures else f"{one['tracking_rms']:.2g}"
