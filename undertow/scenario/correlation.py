"""Correlation matrices in files, and correlated normal numbers."""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from undertow.core.errors import BadInput
from undertow.scenario.values import checked

_SINGULAR = 1e-9  # eigenvalue of a correlation matrix, per row, that counts as zero
_LEAST_PIVOT = 1e-12  # below which a number follows from those before it

Matrix = Float[np.ndarray, "P P"]


def correlation_matrix(location: str, rows: Any, size: int) -> Matrix:
    """A correlation matrix from its lower triangle.

    Args:
        location: key path of the rows, for messages.
        rows: of 1 to `size` numbers, each with a one at its end.
        size: number of rows.

    Raises:
        BadInput: it is none.
    """
    lengths = [len(row) if isinstance(row, list) else 0 for row in rows] if isinstance(rows, list) else []
    if lengths != list(range(1, size + 1)):
        raise BadInput(location, f"be {size} rows of 1 to {size} numbers: the lower triangle, with ones at the ends")
    matrix = np.zeros((size, size))
    for i, row in enumerate(rows):
        matrix[i, : i + 1] = checked(f"{location}[{i}]", row, None, 0.0)
        if row[-1] != 1:
            raise BadInput(f"{location}[{i}]", "end with 1", row[-1])
        if np.abs(matrix[i]).max() > 1:
            raise BadInput(f"{location}[{i}]", "hold numbers from -1 to 1", row)
    matrix = matrix + np.tril(matrix, -1).T
    least = float(np.linalg.eigvalsh(matrix).min())
    if least < -_SINGULAR * size:
        raise BadInput(location, "be positive definite", f"of least eigenvalue {least:.3g}")
    return matrix


def lower_triangle(matrix: Matrix) -> list[list[float]]:
    """Rows from which `correlation_matrix` makes the matrix again."""
    return [matrix[i, : i + 1].tolist() for i in range(len(matrix))]


def square_root(correlation: Matrix) -> Matrix:
    """Lower triangular F with F F' = correlation, which may be singular: Cholesky, with the same bits everywhere."""
    size = len(correlation)
    factor = [[0.0] * size for _ in range(size)]
    for j in range(size):
        for i in range(j, size):
            rest = float(correlation[i, j]) - math.fsum(factor[i][k] * factor[j][k] for k in range(j))
            if i == j:
                factor[j][j] = math.sqrt(rest) if rest > _LEAST_PIVOT else 0.0
            elif factor[j][j]:
                factor[i][j] = rest / factor[j][j]
    return np.array(factor)


def correlated(normal_numbers: Float[np.ndarray, "n P"], factor: Matrix) -> Float[np.ndarray, "n P"]:
    """Normal numbers with the correlation of a `square_root`; each row has the same bits alone and among others."""
    columns = np.zeros_like(normal_numbers)
    for k in range(len(factor)):
        columns += normal_numbers[:, k, None] * factor[:, k]
    return columns
