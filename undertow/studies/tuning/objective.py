"""Objective of the search: costs, gradients and certificates of points, and the best point so far."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Float

from undertow.simulation.checkpoint import Checkpoint, OutOfTime
from undertow.studies.tuning.stability import Certificate

Points = Float[np.ndarray, "p k"]


class Computes(Protocol):
    """Costs and gradients, as computed by `Evaluation`."""

    def costs(self, points: Points) -> np.ndarray:
        """Cost of each point."""
        ...

    def slope(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the cost at a point."""
        ...


class Improvement(NamedTuple):
    """An improvement."""

    evaluations: int
    elapsed: float  # s
    cost: float
    point: list[float]
    radius: float  # spectral


Watch = Callable[[Improvement, int], None]  # called after every batch with the best so far, evaluations so far


_SAME = 12  # decimals to which the coordinates of equal points agree


class Objective:
    """Costs with a checkpoint. No point is accepted without a certificate.

    Args:
        computes: gives costs and gradients.
        certify: point -> certificate.
        checkpoint: keeps every evaluation.
        watch: called after every batch.
        most: budget in evaluations, of which a gradient takes two for each parameter; a point that was
            evaluated before takes none. None for no such budget.
    """

    def __init__(
        self,
        computes: Computes,
        certify: Callable[[np.ndarray], Certificate],
        checkpoint: Checkpoint,
        watch: Watch,
        most: int | None = None,
    ):
        self._computes, self._certify, self._checkpoint, self._watch = computes, certify, checkpoint, watch
        self._most = most
        self._known: dict[bytes, float] = {}
        self.evaluations = 0
        self.steps: list[Improvement] = []
        self.rejected = 0

    @property
    def best(self) -> Improvement | None:
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
        costs = self._costs(points, must) if self._most is None else self._costs_within(self._most, points, must)
        for i in np.argsort(costs, kind="stable"):
            if self.best is not None and not costs[i] < self.best.cost:
                break
            radius = self.radius(points[i])
            if radius < 1:
                step = Improvement(
                    self.evaluations, self._checkpoint.elapsed, float(costs[i]), points[i].tolist(), radius
                )
                self.steps.append(step)
                break
            self.rejected += 1
            costs[i] = np.inf
            self._known[_key(points[i])] = np.inf
        if self.best is not None:
            self._watch(self.best, self.evaluations)
        return costs

    def _costs(self, points: Points, must: bool) -> np.ndarray:
        """Costs from the checkpoint, or computed."""
        costs = self._checkpoint.ask("costs", points, lambda: _finite(self._computes.costs(points)), must)
        self.evaluations += len(points)
        return np.asarray(costs)

    def _costs_within(self, most: int, points: Points, must: bool) -> np.ndarray:
        """Costs of the points for which the budget is enough; infinite for the others."""
        keys = [_key(point) for point in points]
        new = [i for i, key in enumerate(keys) if key not in self._known and keys.index(key) == i]
        chosen = new[: most - self.evaluations]
        if new and not chosen:
            raise OutOfTime
        if chosen:
            computed = self._costs(points[chosen], must)
            self._known |= {keys[i]: float(cost) for i, cost in zip(chosen, computed, strict=True)}
        return np.array([self._known.get(key, np.inf) for key in keys])

    def slope(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the cost.

        Raises:
            OutOfTime: the budget is used up.
        """
        evaluations = self.evaluations + 2 * len(point)
        if self._most is not None and evaluations > self._most:
            raise OutOfTime
        gradient = self._checkpoint.ask("slope", point, lambda: self._computes.slope(point).tolist())
        self.evaluations = evaluations
        return np.asarray(gradient)

    def radius(self, point: np.ndarray) -> float:
        """Largest spectral radius of the loop at a point."""
        return float(self._checkpoint.ask("radius", point, lambda: min(self._certify(point).worst, 1e300), must=True))


def _key(point: np.ndarray) -> bytes:
    """Equal for equal points."""
    return (np.round(point, _SAME) + 0.0).tobytes()  # 0 and -0 are equal


def _finite(costs: np.ndarray) -> list[float]:
    """Finite numbers, as JSON requires."""
    return np.nan_to_num(np.asarray(costs, dtype=float), nan=1e300, posinf=1e300).tolist()
