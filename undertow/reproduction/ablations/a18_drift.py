"""A18: cures of parameter drift."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.core.contracts import Model
from undertow.disturbances.random_suite import random_suite
from undertow.reproduction.ablations.ablation import Answer, Schedule, Variant, answer
from undertow.reproduction.ablations.forgetting import Forgetting
from undertow.reproduction.ablations.on_axes import basis_norm_squared, loop
from undertow.reproduction.ablations.rough_sensor import RoughSensor

QUESTION = "What keeps the weights from drifting in noise?"
PREDICTION = (
    "Nothing: lost in 7.5 s; leakage 1e-3 or a dead zone of 3 sigma: lost; projection, leakage 1e-2, one set: kept."
)
METRICS = ("tracking_rms", "input_rms", "weights_peak")

_NOISE = 0.01  # m/s
_SETS = {"sets": 3, "reach": (0.1,)}
_CURES = {
    "nothing": ({}, {}),
    "projection 20": ({"weights_bound": 20.0}, {}),
    "projection 6": ({"weights_bound": 6.0}, {}),
    "leakage 1e-3": ({}, {"leakage": 1e-3}),
    "leakage 1e-2": ({}, {"leakage": 1e-2}),
    "e-modification": ({}, {"e_mod": 1.0}),
    "dead zone": ({}, {"zone": 3 * _NOISE}),
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Three sets spaced 0.1, 1 cm/s of velocity noise, 20 s; and one set of the same gamma |xi|^2."""
    still, noisy, long = random_suite(0.3, step=0.3), RoughSensor(noise=_NOISE), Schedule(duration=20.0)
    cured = [
        Variant(name, _text(options, cure), loop(partial(_law, options, cure), still, noisy), long)
        for name, (options, cure) in _CURES.items()
    ]
    matched = 100 * basis_norm_squared(**_SETS)
    one = partial(paper, sets=1, adaptation=matched)
    return (*cured, Variant("one set", f"sets: 1, adaptation: {matched:.4g}", loop(one, still, noisy), long))


def _law(options: dict, cure: dict, model: Model) -> Forgetting:
    return Forgetting(paper(model, **_SETS, **options), **cure)


def _text(options: dict, cure: dict) -> str:
    return ", ".join(["sets: 3, reach: [0.1]", *(f"{key}: {value:g}" for key, value in {**options, **cure}.items())])


def judge(found) -> Answer:
    """Which lasted."""
    lost = [name for name, one in found.items() if one.failures > one.seeds / 2]
    kept = [f"{name} ({one['tracking_rms']:.2g} m)" for name, one in found.items() if name not in lost]
    text = f"Ended early: {', '.join(lost) or 'none'}. Kept: {', '.join(kept)}."
    sound = not {"projection 20", "projection 6", "leakage 1e-2", "one set"} & set(lost)
    return answer(sound and {"nothing", "leakage 1e-3", "dead zone"} <= set(lost), text, partly=sound)
