"""A node of a graph that can be written in formulas."""

from typing import Any

from simdjit.graph import Graph, Node


class Scalar:
    """One number per lane; Python's numbers beside it are constants of its type."""

    __slots__ = ("graph", "node")

    def __init__(self, graph: Graph, node: Node):
        self.graph, self.node = graph, node

    @property
    def type(self) -> str:
        """NumPy's name of it."""
        return self.graph.types[self.node]

    def constant(self, value: float) -> "Scalar":
        """A constant of the same type."""
        return Scalar(self.graph, self.graph.constant(value, self.type))

    def to(self, name: str, dtype: str) -> "Scalar":
        """`convert`ed to another type, or its `bits` read as another one of the same size."""
        if dtype == self.type:
            return self
        return Scalar(self.graph, self.graph.apply(name, self.node, dtype=dtype))

    def apply(self, name: str, *others: Any) -> "Scalar":
        """An operation on this and others."""
        graph = self.graph
        given = [
            other.node if isinstance(other, Scalar) else graph.constant(other, graph.types[self.node])
            for other in others
        ]
        return Scalar(graph, graph.apply(name, self.node, *given))

    def __add__(self, other):
        return self.apply("add", other)

    def __sub__(self, other):
        return self.apply("sub", other)

    def __mul__(self, other):
        return self.apply("mul", other)

    def __truediv__(self, other):
        return self.apply("div", other)

    def __radd__(self, other):
        return self.constant(other).apply("add", self)

    def __rsub__(self, other):
        return self.constant(other).apply("sub", self)

    def __rmul__(self, other):
        return self.constant(other).apply("mul", self)

    def __rtruediv__(self, other):
        return self.constant(other).apply("div", self)

    def __neg__(self):
        return self.apply("neg")

    def __abs__(self):
        return self.apply("abs")

    def __lt__(self, other):
        return self.apply("lt", other)

    def __gt__(self, other):
        return self.apply("gt", other)

    def __and__(self, other):
        return self.apply("and", other)

    def __or__(self, other):
        return self.apply("or", other)

    def __xor__(self, other):
        return self.apply("xor", other)

    def __lshift__(self, other):
        return self.apply("shift_left", other)

    def __rshift__(self, other):
        return self.apply("shift_right", other)

    def __floordiv__(self, other):
        """Of whole numbers, towards zero."""
        return self.apply("div", other)

    def signed(self, other: Any) -> "Scalar":
        """With the sign of another."""
        return self.apply("copysign", other)

    def equal(self, other: Any) -> "Scalar":
        """Whether it is the same number."""
        return self.apply("eq", other)


def where(which: Scalar, if_true: Scalar | float, if_false: Scalar | float) -> Scalar:
    """One or the other; one of the two is a `Scalar`."""
    if not isinstance(if_true, Scalar):
        assert isinstance(if_false, Scalar)
        if_true = if_false.constant(if_true)
    return which.apply("select", if_true, if_false if isinstance(if_false, Scalar) else if_true.constant(if_false))


def fused(a: Scalar, b: Scalar | float, c: Scalar | float) -> Scalar:
    """a b + c, rounded once."""
    return a.apply("fma", b, c)


def larger(a: Scalar, b: Scalar | float) -> Scalar:
    """The larger of two; not a number where either is none."""
    return _chosen(a, b, "gt")


def smaller(a: Scalar, b: Scalar | float) -> Scalar:
    """The smaller of two; not a number where either is none."""
    return _chosen(a, b, "lt")


def _chosen(a: Scalar, b: Scalar | float, comparison: str) -> Scalar:
    """A comparison with what is not a number is false, so the second operand is what is left: where one of them is a
    constant, it stands first, and otherwise the first one is tested again."""
    if not isinstance(b, Scalar):
        b = a.constant(b)
    graph = a.graph
    if graph.value(a.node) is None:
        a, b = b, a
    value = graph.value(a.node)
    chosen = where(a.apply(comparison, b), a, b)
    if not a.type.startswith("float") or (value is not None and value == value):
        return chosen
    return where(a.apply("ne", a), a, chosen)
