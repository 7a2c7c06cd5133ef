"""Search without gradients, for costs that are not smooth: differential evolution (SciPy), one generation per batch."""

import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from undertow.tuning.evaluator import AT_ONCE
from undertow.tuning.objective import Objective

_HOPELESS = 1e6  # cost of a point without a certificate
_SPREAD = 1e-3  # relative spread of the costs at which the population has converged


def spread_points(count: int, parameters: int, seed: int) -> np.ndarray:
    """Points that fill the box evenly, by Sobol's sequence."""
    with np.errstate(all="ignore"):
        sequence = qmc.Sobol(parameters, rng=np.random.default_rng(seed))
        return sequence.random_base2(int(np.ceil(np.log2(count))))[:count]


def search(objective: Objective, start: np.ndarray, iterations: int, seed: int) -> None:
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
        init=first,
        maxiter=iterations,
        tol=_SPREAD,
        rng=np.random.default_rng(seed),
        polish=False,
        updating="deferred",
        vectorized=True,
    )
