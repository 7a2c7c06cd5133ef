"""A3: linear laws of the same bandwidth."""

from functools import partial

import jax.numpy as jnp

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.controllers.robust.robust_law import RobustRCAF
from undertow.core.contracts import Model
from undertow.reproduction.ablations import gains
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.incremental import Incremental
from undertow.reproduction.ablations.linear_observer import LinearObserver
from undertow.reproduction.ablations.on_axes import loop

QUESTION = "Is a plain linear observer of the same bandwidth as good?"
PREDICTION = (
    "Linear observer (ESO, ADRC, PI observer) and INDI do the same within 1 %, beside RCAFC at Table 1 and beside "
    "preset `robust`; RAFC at Table 1 does not."
)
METRICS = ("tracking_rms", "estimation_rms", "input_variation")

_LINEAR = f"pole {gains.POLE:.4g}, b2 {gains.STIFFNESS:.5g}, K ({gains.FEEDBACK[0]:g}, {gains.FEEDBACK[1]:g})"
_OF_ROBUST = {"robust", "robust, 1 set", "robust's linear observer", "robust's INDI"}
_SAME = {"pole": gains.POLE, "stiffness": gains.STIFFNESS, "feedback": gains.FEEDBACK}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Five laws, one loop gain; RAFC at Table 1 and at equal loop gain."""
    found = [
        Variant("RCAFC", "Table 1", loop(paper)),
        Variant("linear observer", _LINEAR, loop(lambda model: LinearObserver(model, **_SAME))),
        Variant("RAFC", "composite: 0", loop(partial(paper, composite=0.0))),
        Variant(
            "RAFC, equal gain",
            f"composite: 0, adaptation: {100 * gains.EQUAL_GAIN:.0f}",
            loop(partial(paper, composite=0.0, adaptation=100 * gains.EQUAL_GAIN)),
        ),
    ]
    if not quick:
        same = {"bandwidth": gains.BANDWIDTH, "damping": gains.DAMPING, "feedback": gains.FEEDBACK}
        text = f"bandwidth {gains.BANDWIDTH:.4g}, damping {gains.DAMPING:.3f}, same K"
        found.append(Variant("INDI", _LINEAR, loop(lambda model: Incremental(model, **_SAME))))
        found.append(Variant("robust at Table 1, 1 set", text, loop(partial(_robust, sets=1, **same))))
        found.append(Variant("robust", "preset: robust", loop(_robust)))
        found.append(Variant("robust, 1 set", "preset: robust, sets: 1", loop(partial(_robust, sets=1))))
        found.append(
            Variant("robust's linear observer", "its poles and K", loop(partial(_like_robust, LinearObserver)))
        )
        found.append(Variant("robust's INDI", "its poles and K", loop(partial(_like_robust, Incremental))))
    return tuple(found)


def _robust(model: Model, **options) -> RobustRCAF:
    return robust(model, reference_frequency=0, **options)


def _like_robust(kind, model: Model):
    """A linear law of the poles and the feedback that preset `robust` chooses for a model, sampled at 1 kHz."""
    law, dt = _robust(model), 1e-3
    of_rates, of_estimate = law.estimator.gains(jnp.asarray(dt))
    return kind(model, pole=of_rates / dt, stiffness=of_estimate / dt, feedback=law.feedback)


def judge(found) -> Answer:
    """Tracking error over that of RCAFC."""
    ratio = {name: one["tracking_rms"] / found["RCAFC"]["tracking_rms"] for name, one in found.items()}
    text = "Tracking error over that of RCAFC: " + ", ".join(
        f"{name} {value:.3f}" for name, value in ratio.items() if name not in _OF_ROBUST | {"RCAFC"}
    )
    own = found["robust"]["tracking_rms"] if "robust" in found else None
    for name in ("robust, 1 set", "robust's linear observer", "robust's INDI"):
        if own is not None:
            ratio[name] = found[name]["tracking_rms"] / own
            text += f"; {name} over that of robust {ratio[name]:.4f}"
    linear = ("linear observer", "INDI", "robust, 1 set", "robust's linear observer", "robust's INDI")
    apart = [abs(ratio[name] - 1) for name in linear if name in ratio]
    return answer(max(apart) < 0.01, text + ".", partly=max(apart) < 0.1)
