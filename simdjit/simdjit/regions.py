"""Operations that are not simply done once: loops whose end only the lanes know, and work that often no lane needs."""

from collections.abc import Callable, Sequence

from simdjit.graph import BOOL, Graph, Node, Operation, Region

Step = Callable[[list[Node]], list[Node]]


def repeated(graph: Graph, initial: Sequence[Node], test: Callable[[list[Node]], Node], body: Step) -> list[Node]:
    """Results of a body that is applied again and again, in each lane for as long as its test holds there.

    Args:
        graph: gets the region.
        initial: what the body is applied to at first.
        test: of the results so far.
        body: gives as many results as it is given.
    """
    number, inputs = _opened(graph, initial)
    going = test(inputs)
    if graph.active is not None:
        going = graph.apply("and", going, graph.active)
    outer, graph.active = graph.active, going
    results = body(inputs)
    graph.active = outer
    graph.open = graph.parents[number]
    return _closed(graph, number, Region(True, tuple(inputs), going, tuple(results)), initial)


def branch(graph: Graph, which: Node, arguments: Sequence[Node], body: Step) -> list[Node]:
    """Results of a body that is left out where no lane needs it.

    Args:
        graph: gets the region.
        which: the lanes that need it; results of the others mean nothing.
        arguments: what the body is applied to; constants stay constants.
        body: of as many nodes.
    """
    varying = [node for node in arguments if graph.value(node) is None]
    number, inputs = _opened(graph, varying)
    inner = dict(zip(varying, inputs, strict=True))
    outer = graph.active
    graph.active = which if outer is None else graph.apply("and", which, outer)
    test = graph.active
    results = body([inner.get(node, node) for node in arguments])
    graph.active = outer
    graph.open = graph.parents[number]
    return _closed(graph, number, Region(False, tuple(inputs), test, tuple(results)), varying)


def _opened(graph: Graph, outer: Sequence[Node]) -> tuple[int, list[Node]]:
    number = len(graph.parents)
    graph.parents.append(graph.open)
    graph.open = number
    return number, [graph.input(("region", number, i), graph.types[node], number) for i, node in enumerate(outer)]


def _closed(graph: Graph, number: int, region: Region, initial: Sequence[Node]) -> list[Node]:
    graph.regions[number] = region
    captured = _captured(graph, number, [region.test, *region.results])
    node = graph.node(Operation("region", (*initial, *captured), number), BOOL)
    return [graph.node(Operation("result", (node,), i), graph.types[result]) for i, result in enumerate(region.results)]


def _captured(graph: Graph, number: int, results: Sequence[Node]) -> list[Node]:
    """What a region uses from outside."""
    captured, seen, stack = [], set(), list(results)
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        if graph.inside(node, number):
            stack += graph.operations[node].operands
        else:
            captured.append(node)
    return sorted(captured)
