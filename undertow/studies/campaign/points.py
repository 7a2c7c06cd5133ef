"""Where the draws of a campaign lie: points of the unit cube, and what they stand for."""

import math
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.special import ndtri
from scipy.stats import qmc

from undertow.studies.campaign.schema import Campaign, Spread

# Of the seed: what else is drawn from it.
_POINTS, _SEEDS = 0, 1

# The quantiles of a normal distribution are infinite at 0 and 1.
_EDGE = 2.0**-53


def points(campaign: Campaign) -> Float[np.ndarray, "trials k"]:
    """One point per draw, in the order of the draws; the same for every machine and every way of running."""
    count, dimensions = campaign.trials, len(campaign.vary)
    if not dimensions:
        return np.zeros((count, 0))
    chance = np.random.default_rng([campaign.seed, _POINTS])
    if campaign.design == "latin":
        return qmc.LatinHypercube(dimensions, rng=chance).random(count)
    if campaign.design == "sobol":
        whole = qmc.Sobol(dimensions, rng=chance).random_base2(math.ceil(math.log2(count)) if count > 1 else 0)
        return whole[:count]
    return chance.random((count, dimensions))


def seeds(campaign: Campaign) -> np.ndarray:
    """Seed of each draw."""
    return np.random.default_rng([campaign.seed, _SEEDS]).integers(0, 2**32, campaign.trials, dtype=np.uint32)


def value(spread: Spread, share: float) -> Any:
    """What a coordinate in [0, 1) of a point stands for: the quantile of the distribution."""
    if spread.uniform is not None:
        low, high = spread.uniform
        return low + share * (high - low)
    if spread.log_uniform is not None:
        low, high = spread.log_uniform
        return low * (high / low) ** share
    if spread.normal is not None:
        mean, deviation = spread.normal
        return float(mean + deviation * ndtri(np.clip(share, _EDGE, 1 - _EDGE)))
    choices = spread.choice or []
    return choices[min(int(share * len(choices)), len(choices) - 1)]
