"""A5: amplitude and layer of the robust term; sign or tanh."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_axes import loop

QUESTION = "Amplitude and boundary layer of the robust term; sign or tanh?"
PREDICTION = "Only the slope w_bar/phi counts, as a PD gain; sign chatters at half the sampling rate."
LONG = True
METRICS = ("tracking_rms", "input_rms", "input_variation")

_PAIRS = ((10.0, 0.5), (20.0, 1.0), (2.0, 0.5), (10.0, 2.5))


def variants(quick: bool) -> tuple[Variant, ...]:
    """Pairs of the same and of another slope, and sign."""
    pairs = [
        Variant(
            f"{gain:g} / {layer:g}",
            f"robust_gain: {gain:g}, layer: {layer:g}",
            loop(partial(paper, robust_gain=gain, layer=layer)),
        )
        for gain, layer in _PAIRS
    ]
    return (*pairs, Variant("sign", "switching: sign", loop(partial(paper, switching="sign"))))


def judge(found) -> Answer:
    """Equal slopes against each other, and the variation of sign."""
    same = found["20 / 1"]["tracking_rms"] / found["10 / 0.5"]["tracking_rms"]
    slope = found["10 / 2.5"]["tracking_rms"] / found["2 / 0.5"]["tracking_rms"]
    chatter = found["sign"]["input_variation"] / found["10 / 0.5"]["input_variation"]
    text = (
        f"Same slope, other amplitude: {same:.3f} and {slope:.3f} times the error. sign varies the input by "
        f"{found['sign']['input_variation']:.3g} m/s^2 per s, {chatter:.0f} times as much as tanh."
    )
    return answer(abs(same - 1) < 0.02 and abs(slope - 1) < 0.02 and chatter > 100, text, partly=chatter > 100)
