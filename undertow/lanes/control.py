"""JAX's branches and loops."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from undertow.lanes import elementwise, regions
from undertow.lanes.errors import Unsupported
from undertow.lanes.graph import BOOL, Graph, Node
from undertow.lanes.nodes import Nodes, filled, flat

Evaluate = Callable[[Graph, Any, Sequence[Nodes]], list[Nodes]]

# A loop of at most so many rounds is written out.
_ROUNDS = 64

# Operations of a branch that are worth a look whether any lane needs them.
_WORTH = 300


def _shaped(nodes: Sequence[Node], like: Sequence[Any]) -> list[Nodes]:
    """Arrays of the shapes of others."""
    ends = np.cumsum([0, *(int(np.prod(other.shape)) for other in like)]).tolist()
    parts = zip(pairwise(ends), like, strict=True)
    return [filled(other.shape, nodes[first:last]) for (first, last), other in parts]


def _cond(graph: Graph, given: list[Nodes], params: dict[str, Any], evaluate: Evaluate) -> list[Nodes]:
    """All branches that any lane needs, and the choice between their results."""
    which, *rest = given
    index = int(which)
    known = graph.value(index)
    if known is not None:
        return evaluate(graph, params["branches"][int(known)], rest)
    cases = [_case(graph, index, i, branch, rest, evaluate) for i, branch in enumerate(params["branches"])]
    choose = partial(elementwise.on(graph, "select_n"), index)
    return _shaped([choose(*row) for row in zip(*map(flat, cases), strict=True)], cases[0])


def _case(graph: Graph, index: Node, number: int, branch: Any, rest: list[Nodes], evaluate: Evaluate) -> list[Nodes]:
    before, loops = len(graph.operations), len(graph.regions)
    plain = evaluate(graph, branch, rest)
    if len(graph.operations) - before < _WORTH and len(graph.regions) == loops:
        return plain
    if graph.types[index] == BOOL:
        here = index if number else graph.apply("xor", index, graph.constant(True, BOOL))
    else:
        here = graph.apply("eq", index, graph.like(number, index))
    body = lambda inner: flat(evaluate(graph, branch, _shaped(inner, rest)))
    return _shaped(regions.branch(graph, here, flat(rest), body), plain)


def _while(graph: Graph, given: list[Nodes], params: dict[str, Any], evaluate: Evaluate) -> list[Nodes]:
    tested, stepped = params["cond_nconsts"], params["body_nconsts"]
    of_test, of_body, carry = given[:tested], given[tested:][:stepped], given[tested + stepped :]

    def test(inner: list[Node]) -> Node:
        (going,) = evaluate(graph, params["cond_jaxpr"], [*of_test, *_shaped(inner, carry)])
        return int(going)

    body = lambda inner: flat(evaluate(graph, params["body_jaxpr"], [*of_body, *_shaped(inner, carry)]))
    return _shaped(regions.repeated(graph, flat(carry), test, body), carry)


def _scan(graph: Graph, given: list[Nodes], params: dict[str, Any], evaluate: Evaluate) -> list[Nodes]:
    """Written out; where it is long and only carries, a loop."""
    constants, carried = _counts(params)
    fixed, carry, rows = given[:constants], given[constants:][:carried], given[constants + carried :]
    rounds, body = params["length"], params["jaxpr"]
    if rounds > _ROUNDS:
        if rows or len(body.out_avals) > carried:
            raise Unsupported(f"scan of {rounds} rounds")
        counter = np.array(graph.constant(0, "int64"))
        more = lambda inner: graph.apply("lt", inner[0], graph.like(rounds, inner[0]))

        def step(inner: list[Node]) -> list[Node]:
            count, *now = _shaped(inner, [counter, *carry])
            following = graph.apply("add", int(count), graph.like(1, int(count)))
            return [following, *flat(evaluate(graph, body, [*fixed, *now]))]

        return _shaped(regions.repeated(graph, flat([counter, *carry]), more, step)[1:], carry)
    stacks = []
    for i in reversed(range(rounds)) if params["reverse"] else range(rounds):
        results = evaluate(graph, body, [*fixed, *carry, *(row[i] for row in rows)])
        carry = results[:carried]
        stacks.append(results[carried:])
    stacks = stacks[::-1] if params["reverse"] else stacks
    return [*carry, *(np.stack(column) for column in zip(*stacks, strict=True))]


def _counts(params: dict[str, Any]) -> tuple[int, int]:
    """How many arguments of a scan are constants, and how many are carried; told differently since JAX 0.12."""
    if "ft_in" in params:
        constants, carried, _ = map(len, params["ft_in"].unpack())
        return constants, carried
    return params["num_consts"], params["num_carry"]


RULES: dict[str, Callable[..., list[Nodes]]] = {"cond": _cond, "scan": _scan, "while": _while}
