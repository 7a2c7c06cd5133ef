"""JAX's primitives that only move entries: NumPy does the same with arrays of nodes."""

import numpy as np

from simdjit.graph import Nodes
from simdjit.rules import Equation, rule


@rule("slice", reads="start_indices limit_indices strides")
def _slice(equation: Equation, operand: Nodes) -> Nodes:
    params = equation.params
    strides = params["strides"] or [1] * len(params["start_indices"])
    cuts = zip(params["start_indices"], params["limit_indices"], strides, strict=True)
    return operand[tuple(slice(*cut) for cut in cuts)]


@rule("broadcast_in_dim", reads="shape broadcast_dimensions")
def _broadcast(equation: Equation, operand: Nodes) -> Nodes:
    out = equation.out
    shape = [1] * len(out.shape)
    for size, axis in zip(operand.shape, equation.params["broadcast_dimensions"], strict=True):
        shape[axis] = size
    return np.broadcast_to(operand.reshape(shape), out.shape)


@rule("split", reads="sizes axis")
def _split(equation: Equation, operand: Nodes) -> list[Nodes]:
    return np.split(operand, np.cumsum(equation.params["sizes"])[:-1], axis=equation.params["axis"])


@rule("reshape", reads="new_sizes")
@rule("squeeze", "expand_dims", reads="dimensions")
def _reshape(equation: Equation, operand: Nodes) -> Nodes:
    return operand.reshape(equation.shape)


@rule("transpose", reads="permutation")
def _transpose(equation: Equation, operand: Nodes) -> Nodes:
    return operand.transpose(equation.params["permutation"])


@rule("concatenate", reads="dimension")
def _concatenate(equation: Equation, *operands: Nodes) -> Nodes:
    return np.concatenate(operands, axis=equation.params["dimension"])


@rule("stack", reads="axis")
def _stack(equation: Equation, *operands: Nodes) -> Nodes:
    return np.stack(operands, axis=equation.params["axis"])


@rule("unstack", reads="axis")
def _unstack(equation: Equation, operand: Nodes) -> list[Nodes]:
    return list(np.moveaxis(operand, equation.params["axis"], 0))


@rule("rev", reads="dimensions")
def _rev(equation: Equation, operand: Nodes) -> Nodes:
    return np.flip(operand, equation.params["dimensions"])
