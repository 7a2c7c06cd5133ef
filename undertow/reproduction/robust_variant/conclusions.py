"""What the numbers of the chapter say, in sentences."""

from undertow.reproduction.robust_variant import strengths, weaknesses
from undertow.reproduction.robust_variant.lookup import Numbers, Rows

_KINDS = {"wins": strengths.WINS, "same": strengths.SAME, "loses": weaknesses.LOSES, "neither": weaknesses.NEITHER}


def conclusions(ladder: Rows, ablations: Rows) -> dict[str, list[str]]:
    """Lists of sentences; one whose numbers were not computed, or say otherwise, is left out."""
    numbers = Numbers(ladder, ablations)
    return {kind: [said for one in sentences if (said := _said(one, numbers))] for kind, sentences in _KINDS.items()}


def _said(sentence, numbers: Numbers) -> str:
    try:
        return sentence(numbers)
    except KeyError:  # not among what was run
        return ""
