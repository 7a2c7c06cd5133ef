"""A3: linear laws of the same bandwidth."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.studies.ablations import gains
from undertow.studies.ablations.ablation import Answer, Variant, answer
from undertow.studies.ablations.incremental import Incremental
from undertow.studies.ablations.linear_observer import LinearObserver
from undertow.studies.ablations.on_axes import loop

QUESTION = "Is a plain linear observer of the same bandwidth as good?"
PREDICTION = "Linear observer (ESO, ADRC, PI observer) and INDI do the same within 1 %; RAFC at Table 1 does not."
METRICS = ("tracking_rms", "estimation_rms", "input_variation")

_LINEAR = f"pole {gains.POLE:.4g}, b2 {gains.STIFFNESS:.5g}, K ({gains.FEEDBACK[0]:g}, {gains.FEEDBACK[1]:g})"
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
        found.append(Variant("robust, 1 set", text, loop(partial(robust, sets=1, reference_frequency=0, **same))))
    return tuple(found)


def judge(found) -> Answer:
    """Tracking error over that of RCAFC."""
    ratio = {name: one["tracking_rms"] / found["RCAFC"]["tracking_rms"] for name, one in found.items()}
    text = "Tracking error over that of RCAFC: " + ", ".join(
        f"{name} {value:.3f}" for name, value in ratio.items() if name != "RCAFC"
    )
    same = all(abs(ratio[name] - 1) < 0.01 for name in ("linear observer", "INDI") if name in ratio)
    near = all(abs(ratio[name] - 1) < 0.1 for name in ("linear observer", "INDI") if name in ratio)
    return answer(same, text + ".", partly=near)
