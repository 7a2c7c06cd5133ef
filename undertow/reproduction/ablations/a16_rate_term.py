"""A16: J_dot nu in the model or in d."""

from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_heavy import SCHEDULE, hand_tuned, loop

QUESTION = "J_dot nu in the model, or left in d (Remark 2)?"
PREDICTION = "Left in d it is up to 2.8 m/s^2 at 1 m/s: it must be in the model."
LONG = True
METRICS = ("tracking_rms", "uncertainty_rms", "estimation_rms")

_REFERENCES = {
    "slow": {"swing": (0.5, 0.5, 0.3, 0.0, 0.0, 0.5), "rate": 0.3},
    "fast": {"swing": (0.5, 0.5, 0.3, 0.0, 0.5, 0.7), "rate": 1.0},
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """The paper's law tuned by hand, told of it and not."""
    return tuple(
        Variant(f"{what}, {name}", f"rate_term: {str(told).lower()}", loop(hand_tuned, **way, rate_term=told), SCHEDULE)
        for what, way in _REFERENCES.items()
        for name, told in {"in F": True, "in d": False}.items()
    )


def judge(found) -> Answer:
    """Sizes of d and errors."""
    text = "; ".join(
        f"{what}: rms of d {found[f'{what}, in F']['uncertainty_rms']:.3g} in F, "
        f"{found[f'{what}, in d']['uncertainty_rms']:.3g} in d, tracking rms "
        f"{found[f'{what}, in F']['tracking_rms']:.3g} and {found[f'{what}, in d']['tracking_rms']:.3g}"
        for what in _REFERENCES
    )
    gain = found["fast, in d"]["tracking_rms"] / found["fast, in F"]["tracking_rms"]
    return answer(gain > 1.1, text + ".", partly=gain > 1.01)
