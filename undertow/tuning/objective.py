"""Objective of the search: costs, gradients and certificates of points, and the best point so far."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Float

from undertow.tuning.checkpoint import Checkpoint
from undertow.tuning.stability import Certificate

Points = Float[np.ndarray, "p k"]


class Computes(Protocol):
    """Costs and gradients, as computed by `Evaluation`."""

    def costs(self, points: Points) -> np.ndarray:
        """Cost of each point."""
        ...

    def slope(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the cost at a point."""
        ...


class Step(NamedTuple):
    """An improvement."""

    evaluations: int
    elapsed: float  # s
    cost: float
    point: list[float]
    radius: float  # spectral


Watch = Callable[[Step, int], None]  # called after every batch with the best so far, evaluations so far


class Objective:
    """Costs with a checkpoint. No point is accepted without a certificate."""

    def __init__(
        self, computes: Computes, certify: Callable[[np.ndarray], Certificate], checkpoint: Checkpoint, watch: Watch
    ):
        self._computes, self._certify, self._checkpoint, self._watch = computes, certify, checkpoint, watch
        self.evaluations = 0
        self.steps: list[Step] = []
        self.rejected = 0

    @property
    def best(self) -> Step | None:
        """The best certified point so far."""
        return self.steps[-1] if self.steps else None

    def costs(self, points: Points, must: bool = False) -> np.ndarray:
        """Cost of each point; infinite for one that would be the best but has no certificate.

        Args:
            points: shape (points, parameters).
            must: whether to compute them even if the budget is used up.

        Raises:
            OutOfTime: the budget is used up.
        """
        found = np.asarray(self._checkpoint.ask("costs", points, lambda: _finite(self._computes.costs(points)), must))
        self.evaluations += len(points)
        for i in np.argsort(found, kind="stable"):
            if self.best is not None and not found[i] < self.best.cost:
                break
            radius = self.radius(points[i])
            if radius < 1:
                step = Step(self.evaluations, self._checkpoint.elapsed, float(found[i]), points[i].tolist(), radius)
                self.steps.append(step)
                break
            self.rejected += 1
            found[i] = np.inf
        if self.best is not None:
            self._watch(self.best, self.evaluations)
        return found

    def slope(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the cost."""
        return np.asarray(self._checkpoint.ask("slope", point, lambda: self._computes.slope(point).tolist()))

    def radius(self, point: np.ndarray) -> float:
        """Largest spectral radius of the loop at a point."""
        return float(self._checkpoint.ask("radius", point, lambda: min(self._certify(point).worst, 1e300), must=True))


def _finite(costs: np.ndarray) -> list[float]:
    """Finite numbers, as JSON requires."""
    return np.nan_to_num(np.asarray(costs, dtype=float), nan=1e300, posinf=1e300).tolist()
