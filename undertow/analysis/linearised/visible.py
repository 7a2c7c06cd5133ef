"""The part of a linear loop that can be excited and seen: counters, norms and idle weights are not in it."""

import numpy as np
from scipy.linalg import matrix_balance

from undertow.analysis.linearised.closing import LinearLoop

# Of the size of the system: a direction reached by less than this is reached by rounding.
_REACHED = 1e-9


def visible(loop: LinearLoop, entries: tuple[str, ...], signals: tuple[str, ...]) -> LinearLoop:
    """The loop in the states that some of its entries reach and some of its signals show (Kalman's decomposition).

    Args:
        loop: in all its states.
        entries: names of what may excite it.
        signals: names of what is looked at.
    """
    # Rates instead of steps, in units in which rows and columns are alike, so that one tolerance serves all.
    rates = (loop.matrix - np.eye(len(loop.matrix))) / loop.dt
    _, (units, _) = matrix_balance(rates, permute=False, separate=True)
    rates = rates / units[:, None] * units
    into = np.hstack([loop.entries[name] for name in entries]) / units[:, None]
    out = np.vstack([loop.signals[name] for name in signals]) * units
    reached = _spanned(rates, into)
    seen = _spanned((reached.T @ rates @ reached).T, (out @ reached).T)
    basis = reached @ seen
    return LinearLoop(
        matrix=np.eye(basis.shape[1]) + loop.dt * (basis.T @ rates @ basis),
        entries={name: basis.T @ (entry / units[:, None]) for name, entry in loop.entries.items()},
        signals={name: (signal * units) @ basis for name, signal in loop.signals.items()},
        direct=loop.direct,
        dt=loop.dt,
    )


def _spanned(matrix: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the smallest subspace that holds `start` and is kept by `matrix`: block Arnoldi."""
    norms = np.linalg.norm(start, axis=0)
    new = _orthonormal(start[:, norms > 0] / norms[norms > 0], _REACHED)
    basis = new
    size = np.linalg.norm(matrix, 2)
    while new.shape[1] and basis.shape[1] < len(matrix):
        new = matrix @ new / size
        for _ in range(2):  # twice is enough (Kahan): once leaves rounding behind
            new = new - basis @ (basis.T @ new)
        new = _orthonormal(new, _REACHED)
        basis = np.hstack([basis, new])
    return basis


def _orthonormal(vectors: np.ndarray, least: float) -> np.ndarray:
    left, sizes, _ = np.linalg.svd(vectors, full_matrices=False)
    return left[:, sizes > least]
