"""A20: gains found by search instead of Table 1."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.reproduction.ablations.ablation import Answer, Schedule, Variant, answer
from undertow.reproduction.ablations.on_odin import loop
from undertow.reproduction.ablations.tuning import COST, tuned

QUESTION = "What does a search find with motor, limits and noise in?"
PREDICTION = "An estimator of 20 to 50 rad/s and hardly a robust term, instead of 142 rad/s and 10 m/s^2."
LONG = True
METRICS = ("tracking_rms", "input_rms", "input_variation")
LEFT_OUT = f"other costs than {COST}; 12 trials on 4 other seeds per law"

_SEA = {"fidelity": "electromechanical", "supply": 24.0, "noise": 2e-3}
_BANDWIDTHS = (15.0, 30.0, 60.0, 120.0)  # rad/s
_TERMS, _RATES = (0.0, 0.3, 1.0), (15.0, 50.0, 150.0)  # m/s^2, 1/s
_RHO = 0.4047  # |xi|^2 of five sets


def variants(quick: bool) -> tuple[Variant, ...]:
    """Table 1, its structure searched, `robust` as it is, and `robust` searched: ODIN, whole motor, 24 V, 2 mm/s."""
    found = [
        Variant("Table 1", "Table 1", loop(paper, **_SEA)),
        Variant("robust", "no gain given", loop(robust, **_SEA)),
    ]
    best = tuned(lambda *point: loop(partial(_paper, *point), **_SEA), (_BANDWIDTHS, _TERMS), Schedule())
    text = f"bandwidth {best.factors[0]:g} rad/s, damping 1, robust_gain: {best.factors[1]:g}"
    found.append(Variant("paper's law, searched", text, best.loop))
    best = tuned(lambda *point: loop(partial(_robust, *point), **_SEA), (_BANDWIDTHS, _RATES), Schedule())
    text = f"preset: robust, bandwidth: {best.factors[0]:g}, actuator_rate: {best.factors[1]:g}"
    found.append(Variant("robust, searched", text, best.loop))
    return tuple(found)


def _paper(bandwidth: float, term: float, model):
    return paper(
        model, pole=2 * bandwidth, adaptation=bandwidth**2 / 500 / _RHO, robust_gain=term, compensation_gain=0.0
    )


def _robust(bandwidth: float, rate: float, model):
    return robust(model, bandwidth=bandwidth, actuator_rate=rate)


def judge(found) -> Answer:
    """Error of each."""
    text = "Tracking rms and variation of the voltage: " + "; ".join(
        f"{name} {one['tracking_rms']:.3g}, {one['input_variation']:.3g} V/s" for name, one in found.items()
    )
    better = found["paper's law, searched"]["tracking_rms"] < found["Table 1"]["tracking_rms"]
    return answer(better and found["robust, searched"]["tracking_rms"] < found["Table 1"]["tracking_rms"], text + ".")
