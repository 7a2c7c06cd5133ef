"""What the sentences of the conclusions are made from."""

from collections.abc import Sequence
from typing import Any

Rows = Sequence[dict[str, Any]]


class Numbers:
    """Medians of the ablations, and rows of the ladder."""

    def __init__(self, ladder: Rows, ablations: Rows):
        self._ladder = {(row["place"], row["law"]): row for row in ladder}
        self._variants = {(one["id"], each["name"]): each for one in ablations for each in one["variants"]}

    def median(self, ablation: str, variant: str, metric: str = "tracking_rms") -> float:
        """Over the seeds."""
        return self._variants[ablation, variant]["metrics"][metric]["median"]

    def failures(self, ablation: str, variant: str) -> tuple[int, int]:
        """Runs that ended early, and runs."""
        one = self._variants[ablation, variant]
        return one["failures"], one["seeds"]

    def fidelity(self, place: str, law: str) -> dict[str, Any]:
        """A row of the ladder."""
        return self._ladder[place, law]
