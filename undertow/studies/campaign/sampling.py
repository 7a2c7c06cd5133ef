"""Samples of a campaign: points of the unit cube, their seeds, and the parameter values they stand for."""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy  # its parts are loaded when they are used
from jaxtyping import Float, Int, UInt32

from undertow.core.errors import BadInput
from undertow.scenario.correlation import correlated, correlation_matrix, square_root
from undertow.studies.campaign.campaign_schema import Campaign, Distribution

# Streams of random numbers from one seed.
_POINTS, _SEEDS = 0, 1

# Samples per block, and number of cached blocks. Sobol's sequence needs a power of two.
_BLOCK, _KEPT = 4096, 8
_MOST_LATIN = 10_000_000

# The quantiles of a normal distribution are infinite at 0 and 1.
_EDGE = 2.0**-53


class Samples:
    """Points of the unit cube and seeds, equal on every machine and with every executor.

    Blocks are computed on demand, so that a billion samples take no memory. Only a Latin hypercube is computed as a
    whole.

    Raises:
        BadInput: too many samples for a Latin hypercube.
    """

    def __init__(self, campaign: Campaign):
        if campaign.design == "latin" and campaign.trials > _MOST_LATIN:
            hint = "`random` and `sobol` have no such limit"
            raise BadInput("trials", f"be at most {_MOST_LATIN} with `design: latin`", campaign.trials, hint=hint)
        self._campaign = campaign
        self._block = campaign.trials if campaign.design == "latin" else _BLOCK
        self._points = functools.lru_cache(_KEPT)(self._make_points)
        self._seeds = functools.lru_cache(_KEPT)(self._make_seeds)
        self._correlated, self._factor = [], np.zeros((0, 0))
        if campaign.correlation is not None:
            keys, rows = campaign.correlation.keys, campaign.correlation.rows
            self._correlated = [list(campaign.vary).index(key) for key in keys]
            self._factor = square_root(correlation_matrix("correlation.rows", rows, len(keys)))

    def points(self, samples: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n k"]:
        """Points of samples, in [0, 1), in the order of `vary`."""
        points = _entries(self._points, self._block, samples)
        if self._correlated:
            points[:, self._correlated] = scipy.special.ndtr(
                correlated(_normal(points[:, self._correlated]), self._factor)
            )
        return points

    def seeds(self, samples: Int[np.ndarray, " n"]) -> UInt32[np.ndarray, " n"]:
        """Seeds of all random numbers of samples."""
        return _entries(self._seeds, _BLOCK, samples)

    def _make_points(self, block: int) -> Float[np.ndarray, "rows k"]:
        seed = self._campaign.seed
        dimensions = len(self._campaign.vary)
        if not dimensions:
            return np.zeros((self._block, 0))
        if self._campaign.design == "random":
            return np.random.default_rng([seed, _POINTS, block]).random((self._block, dimensions))
        chance = np.random.default_rng([seed, _POINTS])
        if self._campaign.design == "latin":
            return scipy.stats.qmc.LatinHypercube(dimensions, rng=chance).random(self._block)
        sequence = scipy.stats.qmc.Sobol(dimensions, rng=chance)
        if block:  # SciPy cannot go forward by nothing
            sequence.fast_forward(block * self._block)
        return sequence.random(self._block)

    def _make_seeds(self, block: int) -> np.ndarray:
        return np.random.default_rng([self._campaign.seed, _SEEDS, block]).integers(0, 2**32, _BLOCK, dtype=np.uint32)


def _entries(make_block: Callable[[int], np.ndarray], size: int, samples: np.ndarray) -> np.ndarray:
    """Entries of a sequence that is made in blocks of a size."""
    blocks, rows = np.divmod(samples, size)
    first_block = make_block(int(blocks[0]) if len(blocks) else 0)
    entries = np.empty((len(samples), *first_block.shape[1:]), dtype=first_block.dtype)
    for block in np.unique(blocks):
        in_block = blocks == block
        entries[in_block] = make_block(int(block))[rows[in_block]]
    return entries


def quantiles(spread: Distribution, shares: Float[np.ndarray, " n"]) -> list[Any]:
    """Parameter values for coordinates in [0, 1): the quantiles of the distribution."""
    if spread.uniform is not None:
        low, high = spread.uniform
        return (low + shares * (high - low)).tolist()
    if spread.log_uniform is not None:
        low, high = spread.log_uniform
        return [low * (high / low) ** share for share in shares.tolist()]
    if spread.normal is not None:
        mean, deviation = spread.normal
        return (mean + deviation * _normal(shares)).tolist()
    if spread.log_normal is not None:
        median, deviation = spread.log_normal
        return [median * math.exp(deviation * number) for number in _normal(shares).tolist()]
    if spread.cut_normal is not None:
        mean, deviation, least = spread.cut_normal
        return np.maximum(mean + deviation * _normal(shares), least).tolist()
    choices = spread.choice or []
    return [choices[min(int(share * len(choices)), len(choices) - 1)] for share in shares.tolist()]


def _normal(shares: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Quantiles of the standard normal distribution."""
    return scipy.special.ndtri(np.clip(shares, _EDGE, 1 - _EDGE))
