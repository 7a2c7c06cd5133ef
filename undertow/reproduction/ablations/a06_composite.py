"""A6: with and without the composite term, each retuned."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.core.contracts import Model
from undertow.disturbances.random_suite import random_suite
from undertow.reproduction.ablations import gains
from undertow.reproduction.ablations.ablation import Answer, Schedule, Variant, answer
from undertow.reproduction.ablations.linear_observer import LinearObserver
from undertow.reproduction.ablations.on_axes import loop
from undertow.reproduction.ablations.rough_sensor import RoughSensor
from undertow.reproduction.ablations.tuning import COST, tuned

QUESTION = "Is the composite law better than RAFC once each is tuned?"
PREDICTION = "Not in accuracy, and a linear observer does as well; the composite law survives limits, RAFC does not."
LONG = True
METRICS = ("tracking_rms", "estimation_rms", "input_variation")
LEFT_OUT = f"other costs than {COST}; 16 trials on 4 other seeds each, 1 mm/s of velocity noise"

_GRID = ((0.1, 1.0, 10.0, 100.0), (0.0, 0.1, 0.3, 1.0))  # on the loop gain of Table 1, on its robust term
_NOISE = RoughSensor(noise=1e-3)
_LIMIT, _GOAL = 4.0, 2.0  # m/s^2, m


def variants(quick: bool) -> tuple[Variant, ...]:
    """Three laws tuned with the same budget, then the same gains with a limit and a step."""
    gentle = random_suite(0.5, step=0.5)
    laws = {"RCAFC": partial(_fuzzy, 500.0), "RAFC": partial(_fuzzy, 0.0), "linear observer": _linear}
    found = []
    for name, law in laws.items():
        best = tuned(lambda a, b, law=law: loop(partial(law, a, b), navigation=_NOISE), _GRID, Schedule())
        gain, term = best.factors
        text = f"loop gain times {gain:g}, robust term times {term:g}"
        limited = loop(partial(law, gain, term), gentle, _NOISE, _GOAL, _LIMIT)
        found.append(Variant(f"{name}, tuned", text, best.loop))
        found.append(Variant(f"{name}, limited", f"{text}; |u| <= {_LIMIT:g} m/s^2, step of {_GOAL:g} m", limited))
    return tuple(found)


def _fuzzy(composite: float, gain: float, term: float, model: Model):
    """The pole grows with the estimator, so that its damping ratio stays."""
    return paper(model, composite=composite, adaptation=100 * gain, pole=150 * gain**0.5, robust_gain=10 * term)


def _linear(gain: float, term: float, model: Model):
    """The same two factors on what Table 1 amounts to."""
    slope = tuple(own + term * (whole - own) for own, whole in zip((1.0, 2.0), gains.FEEDBACK, strict=True))
    return LinearObserver(model, gain**0.5 * gains.POLE, gain * gains.STIFFNESS, slope)


def judge(found) -> Answer:
    """Errors of the tuned laws, and what a limit does to them."""
    error = {name: found[f"{name}, tuned"]["tracking_rms"] for name in ("RCAFC", "RAFC", "linear observer")}
    limited = {name: found[f"{name}, limited"] for name in error}
    text = "Tuned, tracking rms in m: " + ", ".join(f"{name} {value:.3g}" for name, value in error.items())
    text += ". With the limit: " + ", ".join(f"{name} {one['tracking_rms']:.3g}" for name, one in limited.items())
    ended = {name: one.failures for name, one in limited.items() if one.failures}
    text += "".join(f"; {name} ends early in {count} of {limited[name].seeds}" for name, count in ended.items()) + "."
    even = error["RCAFC"] > 0.8 * min(error["RAFC"], error["linear observer"])
    worse = limited["RAFC"]["tracking_rms"] > 3 * limited["RCAFC"]["tracking_rms"]
    return answer(even and worse, text, partly=even or worse)
