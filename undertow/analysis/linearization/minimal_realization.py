"""Minimal realization of a linear loop: without counters, norms and inactive weights."""

from typing import cast

import numpy as np
import scipy  # its parts are loaded when they are used

from undertow.analysis.linearization.linear_loop import LinearLoop

# Of the size of the system: a direction reached by less than this is reached by rounding.
_REACHED = 1e-9

# Of the plainest mode: a mode that is excited and seen by less than this is left over by rounding.
_SEEN = 1e-9


def visible(loop: LinearLoop, entries: tuple[str, ...], signals: tuple[str, ...]) -> LinearLoop:
    """The loop in the states that some of its entries reach and some of its signals show (Kalman's decomposition).

    Args:
        loop: in all its states.
        entries: names of what may excite it.
        signals: names of what is looked at.
    """
    # Rates instead of steps, in units in which rows and columns are alike, so that one tolerance serves all.
    rates = (loop.matrix - np.eye(len(loop.matrix))) / loop.dt
    _, (units, _) = scipy.linalg.matrix_balance(rates, permute=False, separate=True)
    rates = rates / units[:, None] * units
    into = np.hstack([loop.entries[name] for name in entries]) / units[:, None]
    out = np.vstack([loop.signals[name] for name in signals]) * units
    linked = np.eye(len(rates))[:, _linked(rates, into) & _linked(rates.T, out.T)]
    rates_of = lambda basis: basis.T @ rates @ basis
    reached = linked @ _spanned(rates_of(linked), linked.T @ into)
    basis = reached @ _spanned(rates_of(reached).T, (out @ reached).T)
    return LinearLoop(
        matrix=np.eye(basis.shape[1]) + loop.dt * rates_of(basis),
        entries={name: basis.T @ (entry / units[:, None]) for name, entry in loop.entries.items()},
        signals={name: (signal * units) @ basis for name, signal in loop.signals.items()},
        direct=loop.direct,
        dt=loop.dt,
    )


def multipliers(loop: LinearLoop, entries: tuple[str, ...], signals: tuple[str, ...]) -> np.ndarray:
    """Eigenvalues, from step to step, of the modes that the entries excite and the signals show."""
    small = visible(loop, entries, signals)
    values, left, right = cast(tuple[np.ndarray, ...], scipy.linalg.eig(small.matrix, left=True, right=True))
    into = np.hstack([small.entries[name] for name in entries])
    out = np.vstack([small.signals[name] for name in signals])
    into, out = into / _sizes(into, 0), out / _sizes(out.T, 0)[:, None]
    overlap = np.abs((left.conj() * right).sum(axis=0))
    visibility = np.linalg.norm(out @ right, axis=0) * np.linalg.norm(left.conj().T @ into, axis=1)
    return values[visibility > _SEEN * visibility.max(initial=0.0) * np.minimum(overlap, 1.0)]


def _sizes(matrix: np.ndarray, axis: int) -> np.ndarray:
    sizes = np.linalg.norm(matrix, axis=axis)
    return np.where(sizes > 0, sizes, 1.0)


def _linked(matrix: np.ndarray, start: np.ndarray) -> np.ndarray:
    """States that a chain of entries which are not zero connects with `start`: exact, where rounding may not count."""
    linked = (start != 0).any(axis=1)
    while True:
        further = linked | (matrix[:, linked] != 0).any(axis=1)
        if (further == linked).all():
            return linked
        linked = further


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
