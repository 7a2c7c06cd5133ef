"""Noise of residuals, and outliers among them."""

import numpy as np

from undertow.studies.identification.outliers import NEIGHBOURS, from_neighbours

# Standard deviations from the median of the neighbours, from which on a sample counts as an outlier: what the model
# lacks moves all of them.
_OUTLIER = 4.0
_LARGE = 3.0  # standard deviations of the residual, below which no sample is an outlier
SMALLEST_NOISE = 1e-4  # m, rad, m/s, rad/s
_FIRST_NOISE = np.repeat([0.05, 0.03, 0.05, 0.05, 0.05], (3, 3, 3, 3, 1))


def first_noise(counts: np.ndarray) -> np.ndarray:
    """Usual standard deviations, (13,); infinite without samples."""
    return np.where(counts.sum(axis=(0, 1)) > 0, _FIRST_NOISE, np.inf)


def noise_of(residuals: np.ndarray, counts: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Standard deviation of a single sample for each kind of residual, outliers counted by their shares."""
    squares = np.where(counts > 0, shares * counts * residuals**2, 0.0).sum(axis=(0, 1))
    samples = np.where(counts > 0, shares, 0.0).sum(axis=(0, 1))
    mean = squares / np.maximum(samples, 1e-300)
    return np.where(samples > 0, np.maximum(np.sqrt(mean), SMALLEST_NOISE), np.inf)


def outlier_shares(residuals: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """By which residuals count, Huber's: 1, and less for samples far from the median of their neighbours."""
    shares = np.ones(residuals.shape)
    for i in range(residuals.shape[2]):
        measured = counts[:, :, i] > 0
        of_one = residuals[:, :, i][measured] * np.sqrt(counts[:, :, i][measured])
        if len(of_one) >= NEIGHBOURS:
            apart = from_neighbours(of_one)
            scatter = max(_OUTLIER * _deviation(apart), _LARGE * _deviation(np.abs(of_one)))
            limit = max(scatter, _OUTLIER * SMALLEST_NOISE)
            shares[:, :, i][measured] = np.where(apart > limit, limit / np.maximum(apart, limit), 1.0)
    return shares


def _deviation(sizes: np.ndarray) -> float:
    """Standard deviation of numbers of a normal distribution with these sizes, whatever a few of them are."""
    return 1.4826 * float(np.median(sizes))
