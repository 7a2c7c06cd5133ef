"""The rules of JAX's primitives: one table, and with every rule the parameters that it knows.

A primitive without a rule, a parameter that its rule does not know, a result of another kind than JAX's: all that is
`Unsupported`. Nothing is passed over.
"""

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import jax

from simdjit.graph import TYPES, U32, Graph, Node, Nodes, Unsupported


class Equation(NamedTuple):
    """What a rule is to do.

    Attributes:
        graph: gets the operations.
        params: of the primitive.
        outs: shapes and types of the results.
        evaluate: results of a closed jaxpr on this graph, given arguments.
    """

    graph: Graph
    params: dict[str, Any]
    outs: Sequence[Any]
    evaluate: Callable[[Any, Sequence[Nodes]], list[Nodes]]

    @property
    def out(self) -> Any:
        """Shape and type of the only result."""
        (out,) = self.outs
        return out

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the nodes of the only result."""
        return _kind(self.out)[0]

    @property
    def dtype(self) -> str:
        """Of the only result."""
        return _kind(self.out)[1]

    def constant(self, value: Any) -> Node:
        """A number of the type of the only result."""
        return self.graph.constant(value, _kind(self.out)[1])


class _Rule(NamedTuple):
    make: Callable[..., Nodes | list[Nodes]]
    read: frozenset[str]
    idle: frozenset[str]


_RULES: dict[str, _Rule] = {}


def rule(*names: str, reads: str = "", idle: str = "") -> Callable:
    """Register a rule: a function of an `Equation` and the operands, giving a result or a list of them.

    Args:
        names: of the primitives.
        reads: parameters that it goes by, separated by spaces.
        idle: parameters that no result depends on, whatever they are: promises, hints, names.
    """

    def registered(make: Callable) -> Callable:
        for name in names:
            assert name not in _RULES, name
            _RULES[name] = _Rule(make, frozenset(reads.split()), frozenset(idle.split()))
        return make

    return registered


def parameters_read(name: str) -> frozenset[str] | None:
    """Parameters of a primitive that its results depend on; None where there is no rule for it."""
    return _RULES[name].read if name in _RULES else None


def _asks_nothing(value: Any) -> bool:
    """Whether a parameter is None, or a distribution over no devices, as `jax.vmap` writes it."""
    return value is None or (isinstance(value, jax.sharding.NamedSharding) and value.mesh.empty)


def results(name: str, equation: Equation, operands: Sequence[Nodes]) -> list[Nodes]:
    """What a primitive makes of its operands.

    Raises:
        Unsupported: there is no rule for it, or none for its parameters or types.
    """
    if name not in _RULES:
        raise Unsupported(f"no rule for `{name}`")
    kinds = [_kind(out) for out in equation.outs]
    primitive_rule = _RULES[name]
    for key, value in equation.params.items():
        if key not in primitive_rule.read and key not in primitive_rule.idle and not _asks_nothing(value):
            raise Unsupported(f"no rule for `{name}` with {key} {value}")
    try:
        nodes = primitive_rule.make(equation, *operands)
    except Unsupported:
        raise
    except Exception as error:  # a case that nobody has thought of is left to XLA, too
        raise Unsupported(f"the rule for `{name}` failed ({type(error).__name__}: {error})") from error
    nodes = nodes if isinstance(nodes, list) else [nodes]
    if len(nodes) != len(kinds) or not all(map(partial(_is_of, equation.graph), nodes, kinds)):
        raise Unsupported(f"the rule for `{name}` gave something else than {', '.join(map(str, equation.outs))}")
    return nodes


def _is_of(graph: Graph, nodes: Nodes, kind: tuple[tuple[int, ...], str]) -> bool:
    shape, dtype = kind
    return nodes.shape == shape and all(graph.types[node] == dtype for node in nodes.ravel().tolist())


def _kind(out: Any) -> tuple[tuple[int, ...], str]:
    """Shape and type of what stands for a result; keys of random numbers are two words each."""
    dtype = _name(getattr(out, "dtype", out))
    if dtype == "key<fry>":
        return (*out.shape, 2), U32
    if dtype not in TYPES:
        raise Unsupported(f"numbers of type {dtype}")
    return out.shape, dtype


@cache
def _name(dtype: Any) -> str:
    return str(dtype)
