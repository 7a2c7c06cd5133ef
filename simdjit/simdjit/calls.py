"""Functions that stand once in a program and are called: for what is long and seldom needed."""

from collections.abc import Callable

from simdjit.graph import BOOL, Node, Operation
from simdjit.regions import repeated
from simdjit.scalar import Scalar

Formula = Callable[[Scalar], Scalar]

FORMULAS: dict[str, Formula] = {}

# Name of the argument of a function, as an input of its graph.
ARGUMENT = "argument"


def called(name: str) -> Callable[[Formula], Formula]:
    """Register a formula; what it becomes is called where its argument is no constant."""

    def registered(formula: Formula) -> Formula:
        FORMULAS[name] = formula

        def call(x: Scalar) -> Scalar:
            if x.graph.value(x.node) is not None:
                return formula(x)
            return Scalar(x.graph, x.graph.node(Operation("call", (x.node,), name), x.type))

        return call

    return registered


def rarely(which: Scalar, x: Scalar, formula: Formula, usual: Scalar) -> Scalar:
    """A formula of x in the lanes that need it, and left out where none does; in the others the usual."""
    graph = x.graph
    if (known := graph.value(which.node)) is not None:
        return formula(x) if known else usual
    key = ("rarely", which.node, x.node, usual.node)
    if key not in graph.memory:
        # In the outermost place where it can be, as other operations are; no lane is harmed by it.
        here, active = graph.open, graph.active
        graph.open, graph.active = graph.innermost(which.node, x.node, usual.node), None
        graph.memory[key] = _left_out(which.node, x.node, formula, usual)
        graph.open, graph.active = here, active
    return Scalar(graph, graph.memory[key])


def _left_out(which: Node, x: Node, formula: Formula, usual: Scalar) -> Node:
    """A loop of at most one round."""
    graph = usual.graph
    done = graph.constant(False, BOOL)
    body = lambda inner: [formula(Scalar(graph, inner[1])).node, inner[1], done]
    return repeated(graph, [usual.node, x, which], lambda inner: inner[2], body)[0]
