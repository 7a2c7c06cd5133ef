"""From a traced function to the arithmetic of its scalars."""

from collections.abc import Sequence
from math import inf
from typing import Any

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, Literal

from undertow.lanes import collecting, control, elementwise, indexing, moving, threefry
from undertow.lanes.errors import Unsupported
from undertow.lanes.graph import Graph
from undertow.lanes.nodes import Nodes, filled

# Primitives that only call another function.
_CALLS = ("jit", "pjit", "closed_call", "core_call", "checkpoint", "custom_jvp_call", "custom_vjp_call")


def nodes_of(graph: Graph, values: Any) -> Nodes:
    """Constants."""
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
        Unsupported: it has a primitive without a rule, or too many operations.
    """
    known = dict(zip(closed.jaxpr.invars, arguments, strict=True))
    fixed = zip(closed.jaxpr.constvars, closed.consts, strict=True)
    known |= {variable: nodes_of(graph, value) for variable, value in fixed}

    def read(variable: Any) -> Nodes:
        if isinstance(variable, Literal):
            aval: Any = variable.aval
            return nodes_of(graph, np.asarray(variable.val, dtype=aval.dtype))
        return known[variable]

    for equation in closed.jaxpr.eqns:
        known |= zip(equation.outvars, _results(graph, equation, [read(v) for v in equation.invars]), strict=True)
        if len(graph.operations) > most:
            raise Unsupported(f"more than {most} operations")
    return [read(variable) for variable in closed.jaxpr.outvars]


def _results(graph: Graph, equation: Any, given: list[Nodes]) -> Sequence[Nodes]:
    """Results of one equation."""
    name, params = equation.primitive.name, equation.params
    if name in control.RULES:
        return control.RULES[name](graph, given, params, evaluate)
    if name in _CALLS:
        return evaluate(graph, _called(params), given)
    if name == "call_hi_primitive":
        return evaluate(graph, _expanded(params["_prim"]), given)
    out = equation.outvars[0].aval
    if name in moving.RULES:
        moved = moving.RULES[name](given, params, out)
        return moved if equation.primitive.multiple_results else [moved]
    for rules in (collecting.RULES, indexing.RULES):
        if name in rules:
            return [rules[name](graph, given, params, out)]
    if name in threefry.RULES:
        return [_random(graph, name, given, params)]
    rule = elementwise.rule(name, params, str(out.dtype))
    if rule is None:
        raise Unsupported(name)
    rows = zip(*(np.broadcast_to(nodes, out.shape).ravel().tolist() for nodes in given), strict=True)
    return [filled(out.shape, [rule(graph, *row) for row in rows])]


def _random(graph: Graph, name: str, given: list[Nodes], params: dict[str, Any]) -> Nodes:
    usual = params.get("bit_width", 32) in (32, 64) and str(params.get("impl", "fry")) == "fry"
    if not (usual and threefry.available()):
        raise Unsupported("random numbers of another kind")
    return threefry.RULES[name](graph, given, params)


def _called(params: dict[str, Any]) -> ClosedJaxpr:
    """What an equation calls."""
    (called,) = (params[key] for key in ("jaxpr", "call_jaxpr", "fun_jaxpr") if key in params)
    return called if isinstance(called, ClosedJaxpr) else ClosedJaxpr(called, ())


def _expanded(primitive: Any) -> ClosedJaxpr:
    """What a primitive of primitives does; JAX has some since 0.12."""
    whole = lambda *flat: primitive.expand(*jax.tree.unflatten(primitive.in_tree, flat))
    return jax.make_jaxpr(whole)(*primitive.in_avals_flat)
