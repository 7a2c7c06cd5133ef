"""A4: with and without the robust term."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.reproduction.ablations import gains
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_axes import loop
from undertow.reproduction.ablations.rough_sensor import RoughSensor

QUESTION = "What does the robust term do?"
PREDICTION = "It is a PD of gain 100: without it the error is 19 times larger and the noise in u 2.6 times smaller."
METRICS = ("tracking_rms", "input_rms", "input_variation")

_LAWS = {
    "with": ("Table 1", {}),
    "without": ("robust_gain: 0", {"robust_gain": 0.0}),
    "PD instead": (
        f"robust_gain: 0, feedback: {list(gains.FEEDBACK)}",
        {"robust_gain": 0.0, "feedback": gains.FEEDBACK},
    ),
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Each law without noise, and with 1 cm/s."""
    sensors = {"": 0.0, ", noise": 0.01}
    return tuple(
        Variant(
            name + tail,
            text + (f", noise {noise:g} m/s" if noise else ""),
            loop(partial(paper, **options), navigation=RoughSensor(noise=noise)),
        )
        for tail, noise in sensors.items()
        for name, (text, options) in _LAWS.items()
    )


def judge(found) -> Answer:
    """Error and noise with and without."""
    error = found["without"]["tracking_rms"] / found["with"]["tracking_rms"]
    noise = found["with, noise"]["input_variation"] / found["without, noise"]["input_variation"]
    same = found["PD instead"]["tracking_rms"] / found["with"]["tracking_rms"]
    text = (
        f"Without it the tracking error is {error:.1f} times larger and the input varies {noise:.1f} times less in "
        f"noise; a PD of the same slope instead gives {same:.3f} times the error."
    )
    return answer(error > 10 and noise > 1.5 and abs(same - 1) < 0.02, text, partly=error > 10)
