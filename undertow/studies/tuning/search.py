"""Search methods: gradient descent in a box, several step lengths per batch; mutation and selection; differential
evolution (SciPy).
"""

from typing import Protocol

import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from undertow.studies.tuning.evaluator import AT_ONCE


class Searched(Protocol):
    """What the methods minimise, over the unit cube; it keeps the best point itself."""

    def costs(self, points: np.ndarray) -> np.ndarray:
        """Cost of each point."""
        ...


class Descended(Searched, Protocol):
    """The same where the cost has a gradient."""

    def slope(self, point: np.ndarray) -> np.ndarray:
        """Gradient of the cost at a point."""
        ...


_LENGTHS = np.array([2.0, 1.0, 0.4, 0.15, 0.04, 0.005])  # of the quasi-Newton step
_FIRST = 0.2  # largest change of a variable in a step without curvature; the box is 1 wide
_LARGEST = 0.5  # and in any other step
_FLAT = 1e-9  # gradient that counts as zero
_LITTLE = 1e-4  # smallest relative improvement of a useful step
_PATIENCE = 3
_NARROWER, _NEAREST = 0.5, 0.01  # radius of the random search: halved after every failure, down to the smallest


def descend(objective: Descended, start: np.ndarray, cost: float, iterations: int) -> None:
    """From a certified point to a local minimum of the cost in [0, 1]^k; the objective keeps the best.

    Nocedal and Wright (2006), ch. 6. Variables at a bound stay there while the gradient points outward. Instead of a
    sequential line search, all step lengths are evaluated at once and the best certified one is taken. Where none is
    better, random points around the current one are evaluated, with a decreasing radius.

    Args:
        objective: gives costs and gradients.
        start: shape (k,).
        cost: at the start.
        iterations: at most.
    """
    x = start
    inverse = None
    slope = objective.slope(start)
    idle = 0
    stuck = False
    reach = _FIRST
    chance = np.random.default_rng(0)
    for _ in range(iterations):
        free = ~(((x <= 0) & (slope > 0)) | ((x >= 1) & (slope < 0)))
        if np.abs(slope[free]).max(initial=0.0) < _FLAT:
            return
        if stuck:
            ways = reach * chance.uniform(-1.0, 1.0, (len(_LENGTHS), len(x)))
        else:
            ways = _LENGTHS[:, None] * _direction(slope, free, inverse)
        points = np.clip(x + ways, 0.0, 1.0)
        costs = objective.costs(points)
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            reach *= _NARROWER if stuck else 1.0
            if reach < _NEAREST:
                return
            # First the curvature is discarded. Where the gradient itself misleads, because of limits or the
            # certificate, random points around the current one are evaluated.
            inverse, stuck = None, inverse is None
            continue
        stuck = False
        idle = idle + 1 if cost - costs[best] < _LITTLE * abs(cost) else 0
        moved = points[best] - x
        x = points[best]
        cost = float(costs[best])
        before = slope
        if idle >= _PATIENCE:
            return
        slope = objective.slope(x)
        inverse = _updated(inverse, moved, slope - before)


def _direction(slope: np.ndarray, free: np.ndarray, inverse: np.ndarray | None) -> np.ndarray:
    """Quasi-Newton step of the free variables; a gradient step without curvature, or where it would ascend."""
    down = np.where(free, -slope, 0.0)
    if inverse is not None:
        newton = np.where(free, inverse @ down, 0.0)
        if newton @ slope < 0:
            return newton * min(1.0, _LARGEST / np.abs(newton).max())
    return down * _FIRST / np.abs(down).max()


def _updated(inverse: np.ndarray | None, moved: np.ndarray, change: np.ndarray) -> np.ndarray | None:
    """BFGS estimate of the inverse Hessian; unchanged where the curvature along the step is not positive."""
    along = float(moved @ change)
    if not along > 1e-12 * np.linalg.norm(moved) * np.linalg.norm(change):
        return inverse
    identity = np.eye(len(moved))
    if inverse is None:
        inverse = identity * along / float(change @ change)
    left = identity - np.outer(moved, change) / along
    return left @ inverse @ left.T + np.outer(moved, moved) / along


_GROWTH, _SHRINKAGE = 1.5, 0.6  # of the spread after a success and after a failure


def evolve(objective: Searched, start: np.ndarray, cost: float, iterations: int, seed: int) -> None:
    """From a certified point to a minimum by mutation and selection, without gradients; the objective keeps the best.

    Rechenberg (1973): the best of six mutations of a point replaces it where it is better; the spread of the mutations
    grows after a success and shrinks after a failure, until it is too small to matter.

    Args:
        objective: gives the costs.
        start: shape (k,).
        cost: at the start.
        iterations: at most.
        seed: seed of all random numbers.
    """
    x = start
    spread = _FIRST
    chance = np.random.default_rng(seed)
    for _ in range(iterations):
        points = np.clip(x + spread * chance.normal(size=(AT_ONCE, len(x))), 0.0, 1.0)
        costs = objective.costs(points)
        best = int(np.argmin(costs))
        if costs[best] < cost:
            x = points[best]
            cost = float(costs[best])
            spread = min(_GROWTH * spread, _LARGEST)
        else:
            spread *= _SHRINKAGE
        if spread < _NEAREST:
            return


_HOPELESS = 1e6  # cost of a point without a certificate
_SPREAD = 1e-3  # relative spread of the costs at which the population has converged


def spread_points(count: int, parameters: int, seed: int) -> np.ndarray:
    """Points that fill the box evenly, by Sobol's sequence."""
    with np.errstate(all="ignore"):
        sequence = qmc.Sobol(parameters, rng=np.random.default_rng(seed))
        return sequence.random_base2(int(np.ceil(np.log2(count))))[:count]


def search(objective: Searched, start: np.ndarray, iterations: int, seed: int) -> None:
    """Best of a population that mixes its differences, Storn and Price (1997); the objective keeps the best.

    Args:
        objective: gives the costs.
        start: a certified point; the others fill the box.
        iterations: largest number of generations.
        seed: seed of all random numbers.
    """
    parameters = len(start)
    population = AT_ONCE * max(2, int(np.ceil(2 * parameters / AT_ONCE)))
    first = np.vstack([start, spread_points(population - 1, parameters, seed)])
    differential_evolution(
        lambda points: np.minimum(objective.costs(points.T), _HOPELESS),
        [(0.0, 1.0)] * parameters,
        init=first,  # pyright: ignore[reportArgumentType] - SciPy takes an array
        maxiter=iterations,
        tol=_SPREAD,
        rng=np.random.default_rng(seed),
        polish=False,
        updating="deferred",
        vectorized=True,
    )
