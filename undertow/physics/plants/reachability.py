"""Directions of acceleration that no input can give: those outside the range of a gain matrix."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

# Singular values below this share of the largest one, and coefficients below it, count as zero.
_ZERO = 1e-9


_ALONE = 0.9  # component of a direction from which on it is that of one output


def open_loop_advice(what: str, gain, names: Sequence[str], actuator: str = "input") -> tuple[str, ...]:
    """One sentence when some combinations of the outputs cannot be controlled, none otherwise.

    Args:
        what: name of the matrix, which begins the sentence.
        gain: G (n x m), or any matrix with the same range.
        names: of the n outputs.
        actuator: noun for what acts along the columns.
    """
    lost = lost_directions(np.asarray(gain, dtype=float))
    if not len(lost):
        return ()
    shown = ", ".join(_combination(row, names) for row in lost)
    subject, verb = ("directions", "stay") if len(lost) > 1 else ("direction", "stays")
    rank = f"{what} has rank {len(names) - len(lost)} of {len(names)}"
    if np.abs(lost).max(axis=1).min() < _ALONE:
        return (f"{rank}: {subject} {shown} cannot be controlled and {verb} in open loop",)
    *others, last = [names[int(index)] for index in np.abs(lost).argmax(axis=1)]
    outputs = f"{', '.join(others)} and {last}" if others else last
    return (f"no {actuator} controls {outputs}: {rank}, and {subject} {shown} {verb} in open loop",)


def lost_directions(gain: Float[np.ndarray, "n m"]) -> Float[np.ndarray, "k n"]:
    """Rows of length 1 that span the left null space of G: along them x_ddot = F + d, whatever u is.

    Found by singular value decomposition; the basis with the most zeros is returned, because it reads best.
    """
    left, sizes, _ = np.linalg.svd(gain)
    rank = int((sizes > _ZERO * sizes.max(initial=0.0)).sum())
    rows = left[:, rank:].T
    for k in range(len(rows)):  # Gauss-Jordan with the largest pivot
        at, column = np.unravel_index(np.abs(rows[k:]).argmax(), rows[k:].shape)
        rows[[k, k + at]] = rows[[k + at, k]]
        rows[k] /= rows[k, column]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, column], rows[k])
    rows[np.abs(rows) < _ZERO] = 0.0
    rows = rows[np.argsort([np.flatnonzero(row)[0] for row in rows], kind="stable")]
    first = np.array([row[np.flatnonzero(row)[0]] for row in rows])
    return rows * np.sign(first)[:, None] / np.linalg.norm(rows, axis=1, keepdims=True)


def _combination(row: Float[np.ndarray, " n"], names: Sequence[str]) -> str:
    """`0.71 x1 - 0.71 x2`; a single output by its name alone."""
    terms = [(weight, name) for weight, name in zip(row, names, strict=True) if round(abs(weight), 2) > 0]
    if len(terms) == 1:
        return terms[0][1]
    text = " ".join(f"{'-' if weight < 0 else '+'} {abs(weight):.2f} {name}" for weight, name in terms)
    return text.removeprefix("+ ")
