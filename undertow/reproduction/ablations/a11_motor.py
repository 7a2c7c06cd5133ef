"""A11: how much of the thruster's dynamics is there, and what makes the loop bear it."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_odin import loop

QUESTION = "What do the thrusters' dynamics do?"
PREDICTION = "Table 1 is fine without and unstable with them; a slow observer or an inner speed loop is stable."
LONG = True
METRICS = ("tracking_rms", "estimation_rms", "input_variation")

# The theory page's slow observer, section 3.9: 30 rad/s, damping 1, no robust term.
_SLOW = {"pole": 60.0, "adaptation": 900.0 / 0.4047 / 500.0, "robust_gain": 0.0, "compensation_gain": 0.0}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Table 1 on each fidelity; on the whole motor also RAFC, a slow observer and `robust`."""
    whole = "electromechanical"
    found = [
        Variant("Table 1, ideal", "fidelity: ideal", loop(paper)),
        Variant("Table 1, whole motor", f"fidelity: {whole}", loop(paper, whole)),
        Variant("RAFC, whole motor", "composite: 0", loop(partial(paper, composite=0.0), whole)),
        Variant("30 rad/s, whole motor", "pole: 60, robust_gain: 0", loop(partial(paper, **_SLOW), whole)),
        Variant("robust, whole motor", "preset: robust", loop(robust, whole)),
    ]
    if not quick:
        found.append(Variant("Table 1, no winding", "fidelity: shaft", loop(paper, "shaft")))
        measured = loop(robust, whole, speed_sensor=True)
        found.append(Variant("robust, speeds measured", "preset: robust, speed_sensor: true", measured))
    return tuple(found)


def judge(found) -> Answer:
    """Errors, and how many ended early."""
    text = "Tracking rms: " + ", ".join(_said(name, one) for name, one in found.items()) + "."
    lost = not found["Table 1, whole motor"]["tracking_rms"] < 0.02
    kept = all(found[name]["tracking_rms"] < 0.05 for name in ("30 rad/s, whole motor", "robust, whole motor"))
    return answer(lost and kept, text, partly=kept)


def _said(name: str, one) -> str:
    return (
        f"{name} ended early in {one.failures} of {one.seeds}" if one.failures else f"{name} {one['tracking_rms']:.3g}"
    )
