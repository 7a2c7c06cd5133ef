"""A2: how many fuzzy sets, and how wide."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_axes import basis_norm_squared, loop

QUESTION = "How many fuzzy sets, and how wide?"
PREDICTION = "The same once gamma |xi|^2 is the same."
LONG = True
METRICS = ("estimation_rms", "tracking_rms", "weights_peak")

_COUNTS, _QUICK = (1, 3, 5, 15), (1, 5)
_REACHES = (3.0, 0.3)


def variants(quick: bool) -> tuple[Variant, ...]:
    """Table 1 with gamma |xi|^2 kept."""
    counts = [(f"{count} sets", {"sets": count}) for count in (_QUICK if quick else _COUNTS)]
    reaches = [(f"5 sets to {reach:g}", {"reach": (reach,)}) for reach in _REACHES]
    return tuple(_variant(name, options) for name, options in counts + reaches)


def _variant(name: str, options: dict) -> Variant:
    gamma = 100.0 * basis_norm_squared() / basis_norm_squared(**options)
    text = ", ".join(f"{key}: {value}" for key, value in {**options, "adaptation": round(gamma, 2)}.items())
    return Variant(name, text.replace("(", "[").replace(",)", "]"), loop(partial(paper, adaptation=gamma, **options)))


def judge(found) -> Answer:
    """Spread of the estimation error over the variants."""
    nominal = found["5 sets"]["estimation_rms"]
    ratio = {name: one["estimation_rms"] / nominal for name, one in found.items()}
    low, high = min(ratio, key=ratio.__getitem__), max(ratio, key=ratio.__getitem__)
    text = f"Estimation error over that of 5 sets: {ratio[low]:.3f} ({low}) to {ratio[high]:.3f} ({high})."
    return answer(ratio[high] < 1.01 and ratio[low] > 0.99, text, partly=abs(ratio["1 sets"] - 1) < 0.05)
