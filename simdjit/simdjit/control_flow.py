"""JAX's branches and loops."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from simdjit import elementwise, indexing, regions
from simdjit.graph import BOOL, I64, Node, Nodes, Unsupported, filled, flat
from simdjit.rules import Equation, rule

# A loop of at most so many rounds is written out.
_ROUNDS = 64

# Operations of a branch from which on it is tested whether any lane needs it.
_WORTH = 300


def _shaped(nodes: Sequence[Node], like: Sequence[Any]) -> list[Nodes]:
    """Arrays of the shapes of others."""
    ends = np.cumsum([0, *(int(np.prod(other.shape)) for other in like)]).tolist()
    parts = zip(pairwise(ends), like, strict=True)
    return [filled(other.shape, nodes[first:last]) for (first, last), other in parts]


@rule("cond", reads="branches", idle="branches_platforms")
def _cond(equation: Equation, which: Nodes, *operands: Nodes) -> list[Nodes]:
    """All branches that any lane needs, and the choice between their results."""
    graph, branches, index = equation.graph, equation.params["branches"], int(which)
    constant_index = graph.value(index)
    if constant_index is not None:
        return equation.evaluate(branches[min(max(int(constant_index), 0), len(branches) - 1)], operands)
    cases = [_case(equation, index, i, branch, operands) for i, branch in enumerate(branches)]
    choose = partial(elementwise.on(graph, "select_n"), index)
    return _shaped([choose(*row) for row in zip(*map(flat, cases), strict=True)], cases[0])


def _case(equation: Equation, index: Node, number: int, branch: Any, operands: Sequence[Nodes]) -> list[Nodes]:
    graph = equation.graph
    before, loops = len(graph.operations), graph.endless
    plain = equation.evaluate(branch, operands)
    if len(graph.operations) - before < _WORTH and graph.endless == loops:
        return plain
    if graph.types[index] == BOOL:
        chosen = index if number else graph.apply("xor", index, graph.constant(True, BOOL))
    else:
        chosen = graph.apply("eq", index, graph.like(number, index))
    body = lambda inner: flat(equation.evaluate(branch, _shaped(inner, operands)))
    return _shaped(regions.branch(graph, chosen, flat(operands), body), plain)


@rule("platform_index", reads="platforms")
def _platform(equation: Equation) -> Nodes:
    """Which variant of a function is meant for processors, or for whatever there is."""
    platforms = equation.params["platforms"]
    number = next(i for i, names in enumerate(platforms) if names is None or "cpu" in names)
    return np.array(equation.constant(number))


@rule("while", reads="cond_nconsts cond_jaxpr body_nconsts body_jaxpr")
def _while(equation: Equation, *operands: Nodes) -> list[Nodes]:
    params = equation.params
    tested, stepped = params["cond_nconsts"], params["body_nconsts"]
    of_test, of_body, carry = operands[:tested], operands[tested:][:stepped], operands[tested + stepped :]

    def test(inner: list[Node]) -> Node:
        (going,) = equation.evaluate(params["cond_jaxpr"], [*of_test, *_shaped(inner, carry)])
        if going.ndim:
            raise Unsupported("a loop over a batch")
        return int(going)

    body = lambda inner: flat(equation.evaluate(params["body_jaxpr"], [*of_body, *_shaped(inner, carry)]))
    return _repeated(equation, flat(carry), test, body, carry)


def _repeated(
    equation: Equation, initial: list[Node], test: Callable[[list[Node]], Node], body: regions.Step, like: Sequence[Any]
) -> list[Nodes]:
    equation.graph.endless += 1
    return _shaped(regions.repeated(equation.graph, initial, test, body), like)


@rule("scan", reads="reverse length jaxpr num_consts num_carry ft_in ft_out", idle="linear unroll")
def _scan(equation: Equation, *operands: Nodes) -> list[Nodes]:
    """Written out; where it is long and keeps nothing of its rounds, a loop."""
    params = equation.params
    constants, carried = _counts(params)
    fixed, carry, rows = operands[:constants], operands[constants:][:carried], operands[constants + carried :]
    rounds, body = params["length"], params["jaxpr"]
    if rounds > _ROUNDS:
        if len(body.out_avals) > carried:
            raise Unsupported(f"what is kept of a scan of {rounds} rounds")
        return _long_scan(equation, fixed, carry, rows)
    stacks = []
    for i in reversed(range(rounds)) if params["reverse"] else range(rounds):
        results = equation.evaluate(body, [*fixed, *carry, *(row[i] for row in rows)])
        carry = results[:carried]
        stacks.append(results[carried:])
    stacks = stacks[::-1] if params["reverse"] else stacks
    recorded = [np.stack(column) for column in zip(*stacks, strict=True)]
    return [*carry, *(recorded if rounds else [np.zeros(out.shape, dtype=np.int64) for out in equation.outs[carried:]])]


def _long_scan(
    equation: Equation, fixed: Sequence[Nodes], carry: Sequence[Nodes], rows: Sequence[Nodes]
) -> list[Nodes]:
    graph, rounds = equation.graph, equation.params["length"]
    counter = np.array(graph.constant(0, I64))
    more = lambda inner: graph.apply("lt", inner[0], graph.constant(rounds, I64))

    def step(inner: list[Node]) -> list[Node]:
        count, *now = _shaped(inner, [counter, *carry])
        following = graph.apply("add", int(count), graph.constant(1, I64))
        place = graph.apply("sub", graph.constant(rounds - 1, I64), int(count))
        place = place if equation.params["reverse"] else int(count)
        first = graph.constant(0, I64)
        here = [indexing.window(graph, row, [place, *[first] * (row.ndim - 1)], (1, *row.shape[1:]))[0] for row in rows]
        return [following, *flat(equation.evaluate(equation.params["jaxpr"], [*fixed, *now, *here]))]

    return _repeated(equation, flat([counter, *carry]), more, step, [counter, *carry])[1:]


def _counts(params: dict[str, Any]) -> tuple[int, int]:
    """How many arguments of a scan are constants, and how many are carried; in different parameters since JAX 0.12."""
    if "ft_in" in params:
        constants, carried, _ = map(len, params["ft_in"].unpack())
        return constants, carried
    return params["num_consts"], params["num_carry"]
