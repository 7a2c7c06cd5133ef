"""Samples that cannot be right: far from those before and after."""

import numpy as np
import scipy.ndimage

_OUTLIER = 6.0  # times the median size
NEIGHBOURS = 5  # samples with whose median one is compared
_LEAST = 1e-12


def from_neighbours(values: np.ndarray) -> np.ndarray:
    """How far samples lie from the median of five, in each column; of the shape of the samples, (rows, ...)."""
    size = (NEIGHBOURS, *(1,) * (values.ndim - 1))
    apart: np.ndarray = values - scipy.ndimage.median_filter(values, size=size, mode="nearest")
    return np.abs(apart)


def outliers(values: np.ndarray) -> np.ndarray:
    """Whether samples lie far from the median of five, in any column; shape (rows,)."""
    deviation = from_neighbours(values)
    typical = np.median(deviation, axis=0)
    spread = np.percentile(values, 90, axis=0) - np.percentile(values, 10, axis=0)
    # Where most samples are their own median, the typical deviation is near zero and says nothing.
    scale = np.maximum(1.4826 * typical, 0.02 * spread)
    # A fast motion that is sampled slowly is no outlier: there the samples before and after differ, too.
    across = np.zeros(values.shape)
    across[1:-1] = np.abs(values[2:] - values[:-2])
    return np.any(deviation > np.maximum(np.maximum(_OUTLIER * scale, 2 * across), _LEAST), axis=1)
