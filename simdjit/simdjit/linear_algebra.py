"""Small systems of linear equations, written out: LAPACK's steps, pivots included, to rounding."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from simdjit.graph import Nodes, Unsupported
from simdjit.rules import Equation, rule
from simdjit.scalar import Scalar, where

# Unknowns; more of them would be too many instructions.
_MOST = 20

Matrix = list[list[Scalar]]


def _of_each(equation: Equation, step: Callable[..., Sequence[Any]], *operands: Nodes) -> list[Nodes]:
    """Results of a step for every place of stacks of matrices."""
    if max(operands[0].shape[-2:], default=0) > _MOST:
        raise Unsupported(f"a matrix of {operands[0].shape[-2]} by {operands[0].shape[-1]}, more than {_MOST}")
    batch, results = operands[0].shape[:-2], []
    for index in np.ndindex(batch):
        matrices = (
            [[Scalar(equation.graph, node) for node in row] for row in stack_of_rows[index].tolist()]
            for stack_of_rows in operands
        )
        results.append(step(*matrices))
    stacks = zip(*results, strict=True) if results else [()] * len(equation.outs)
    node = np.vectorize(lambda scalar: scalar.node, otypes=[np.int64])
    return [
        node(np.array(stack, dtype=object)).reshape(out.shape) for stack, out in zip(stacks, equation.outs, strict=True)
    ]


@rule("lu")
def _lu(equation: Equation, matrices: Nodes) -> list[Nodes]:
    return _of_each(equation, _factors, matrices)


def _factors(rows: Matrix) -> tuple[Matrix, list[Scalar], list[Scalar]]:
    """Both factors in one matrix, the row that every pivot came from, and where every row came from."""
    whole = lambda i: Scalar(rows[0][0].graph, rows[0][0].graph.constant(i, "int32"))
    order, pivots = [whole(i) for i in range(len(rows))], []
    for k in range(min(len(rows), len(rows[0]))):
        largest, pivot = abs(rows[k][k]), whole(k)
        for i in range(k + 1, len(rows)):
            larger = abs(rows[i][k]) > largest
            largest, pivot = where(larger, abs(rows[i][k]), largest), where(larger, i, pivot)
        pivots.append(pivot)
        for i in range(k + 1, len(rows)):
            here = pivot.equal(i)
            pairs = list(zip([*rows[k], order[k]], [*rows[i], order[i]], strict=True))
            *rows[k], order[k] = (where(here, b, a) for a, b in pairs)
            *rows[i], order[i] = (where(here, a, b) for a, b in pairs)
        for i in range(k + 1, len(rows)):
            factor = where(largest.equal(0.0), rows[i][k], rows[i][k] / rows[k][k])
            left = [a - factor * b for a, b in zip(rows[i][k + 1 :], rows[k][k + 1 :], strict=True)]
            rows[i] = [*rows[i][:k], factor, *left]
    return rows, pivots, order


@rule("cholesky")
def _cholesky(equation: Equation, matrices: Nodes) -> Nodes:
    return _of_each(equation, lambda rows: [_root(rows)], matrices)[0]


def _root(rows: Matrix) -> Matrix:
    """The lower factor of a symmetric matrix; no numbers at all where it is not positive definite."""
    size, zero = len(rows), rows[0][0].constant(0.0)
    factor = [[zero] * size for _ in rows]
    sound = zero.equal(0.0)
    for j in range(size):
        difference = rows[j][j]
        for k in range(j):
            difference = difference - factor[j][k] * factor[j][k]
        sound = sound & (difference > 0.0)
        factor[j][j] = difference.apply("sqrt")
        for i in range(j + 1, size):
            difference = rows[i][j]
            for k in range(j):
                difference = difference - factor[i][k] * factor[j][k]
            factor[i][j] = difference / factor[j][j]
    return [
        [where(sound, entry, float("nan")) if j <= i else zero for j, entry in enumerate(row)]
        for i, row in enumerate(factor)
    ]


@rule("triangular_solve", reads="left_side lower transpose_a unit_diagonal", idle="conjugate_a")
def _triangular_solve(equation: Equation, matrix: Nodes, right: Nodes) -> Nodes:
    params = equation.params
    turned = params["transpose_a"] == params["left_side"]  # x A = b is A' x' = b'
    lower = params["lower"] != turned
    if turned:
        matrix = np.swapaxes(matrix, -1, -2)
    if not params["left_side"]:
        right = np.swapaxes(right, -1, -2)

    def step(rows: Matrix, right: Matrix) -> list[Matrix]:
        size = len(rows)
        for i in range(size) if lower else reversed(range(size)):
            for j in range(i) if lower else range(i + 1, size):
                right[i] = [b - rows[i][j] * x for b, x in zip(right[i], right[j], strict=True)]
            if not params["unit_diagonal"]:
                right[i] = [b / rows[i][i] for b in right[i]]
        return [right if params["left_side"] else [list(column) for column in zip(*right, strict=True)]]

    return _of_each(equation, step, matrix, right)[0]


@rule("custom_linear_solve", reads="const_lengths jaxprs")
def _solve(equation: Equation, *operands: Nodes) -> list[Nodes]:
    """By the function that came along for it."""
    lengths, called = equation.params["const_lengths"], equation.params["jaxprs"]
    before = lengths.matvec + lengths.vecmat
    constants = operands[before:][: lengths.solve]
    return equation.evaluate(called.solve, [*constants, *operands[sum(lengths) :]])
