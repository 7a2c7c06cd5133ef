"""From a traced function to the arithmetic of its scalars."""

from collections.abc import Sequence
from functools import partial
from math import inf
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Literal

from simdjit import control_flow, elementwise, indexing, linear_algebra, reductions, shapes, sorting, threefry
from simdjit.estimate import spaced
from simdjit.graph import Graph, Nodes, Unsupported, filled
from simdjit.rules import Equation, results, rule

# Modules whose import registers their rules.
RULES_OF = (control_flow, elementwise, indexing, linear_algebra, reductions, shapes, sorting, threefry)


class TooLong(Unsupported):
    """A function has more operations than are allowed."""


def nodes_of(graph: Graph, values: Any) -> Nodes:
    """Constants."""
    if hasattr(values, "dtype") and jnp.issubdtype(values.dtype, jax.dtypes.extended):
        raise Unsupported(f"a constant of type {values.dtype}")
    values = np.asarray(values)
    return filled(values.shape, [graph.constant(value, str(values.dtype)) for value in values.ravel()])


def evaluate(graph: Graph, closed: Any, arguments: Sequence[Nodes], most: float = inf) -> list[Nodes]:
    """Results of a closed jaxpr.

    Args:
        graph: gets the operations.
        closed: what `jax.make_jaxpr` gives.
        arguments: nodes of its arguments.
        most: operations of the graph.

    Raises:
        Unsupported: it has a primitive without a rule.
        TooLong: it has too many operations.
    """
    values = dict(zip(closed.jaxpr.invars, arguments, strict=True))
    fixed = zip(closed.jaxpr.constvars, closed.consts, strict=True)
    values |= {variable: nodes_of(graph, value) for variable, value in fixed}

    def read(variable: Any) -> Nodes:
        if isinstance(variable, Literal):
            aval: Any = variable.aval
            return nodes_of(graph, np.asarray(variable.val, dtype=aval.dtype))
        return values[variable]

    within = partial(evaluate, graph, most=most)
    for equation in closed.jaxpr.eqns:
        equation_here = Equation(graph, equation.params, [variable.aval for variable in equation.outvars], within)
        outputs = results(equation.primitive.name, equation_here, [read(variable) for variable in equation.invars])
        values |= zip(equation.outvars, outputs, strict=True)
        if len(graph.operations) > most:
            raise TooLong(f"more than {spaced(int(most))} operations")
    return [read(variable) for variable in closed.jaxpr.outvars]


@rule(
    "jit",
    "pjit",
    reads="jaxpr",
    idle="in_shardings out_shardings in_layouts out_layouts donated_invars ctx_mesh name keep_unused inline"
    " compiler_options_kvs",
)
@rule("closed_call", "core_call", reads="call_jaxpr", idle="name")
@rule("checkpoint", reads="jaxpr", idle="prevent_cse differentiated policy")
@rule("custom_jvp_call", reads="call_jaxpr", idle="jvp_jaxpr_fun num_consts symbolic_zeros")
@rule("custom_vjp_call", reads="call_jaxpr fun_jaxpr", idle="fwd_jaxpr_thunk bwd num_consts out_trees symbolic_zeros")
def _call(equation: Equation, *operands: Nodes) -> list[Nodes]:
    """Primitives that only call another function."""
    params = equation.params
    (called,) = (params[key] for key in ("jaxpr", "call_jaxpr", "fun_jaxpr") if key in params)
    return equation.evaluate(called if isinstance(called, ClosedJaxpr) else ClosedJaxpr(called, ()), operands)


@rule("call_hi_primitive", reads="_prim")
def _expanded(equation: Equation, *operands: Nodes) -> list[Nodes]:
    """What a primitive of primitives does; JAX has some since 0.12."""
    primitive = equation.params["_prim"]
    expanded = lambda *flat: primitive.expand(*jax.tree.unflatten(primitive.in_tree, flat))
    return equation.evaluate(jax.make_jaxpr(expanded)(*primitive.in_avals_flat), operands)
