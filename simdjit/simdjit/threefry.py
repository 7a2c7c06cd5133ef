"""Random numbers: the same bits as `jax.random` gives for a threefry key.

J. K. Salmon and others, Parallel random numbers: as easy as 1, 2, 3 (2011): Threefry-2x32 with 20 rounds.
"""

from collections.abc import Sequence

import jax
import numpy as np

from simdjit.graph import U32, U64, Graph, Nodes, Unsupported
from simdjit.rules import Equation, rule
from simdjit.scalar import Scalar

_TURNS = ((13, 15, 26, 6), (17, 29, 16, 24))
_PARITY = 0x1BD11BDA


def threefry(key: Sequence[Scalar], count: Sequence[Scalar]) -> tuple[Scalar, Scalar]:
    """Two words for a key and a counter of two words each."""
    keys = (*key, key[0] ^ key[1] ^ _PARITY)
    x, y = count[0] + keys[0], count[1] + keys[1]
    for group in range(5):
        for turn in _TURNS[group % 2]:
            x = x + y
            y = x ^ ((y << turn) | (y >> (32 - turn)))
        x, y = x + keys[(group + 1) % 3], y + keys[(group + 2) % 3] + (group + 1)
    return x, y


def _keys(graph: Graph, nodes: Nodes) -> list[tuple[Scalar, Scalar]]:
    """Keys of an array of them; their two words stand along its last axis."""
    if not jax.config.jax_threefry_partitionable:  # pyright: ignore[reportAttributeAccessIssue]
        raise Unsupported("random numbers with jax_threefry_partitionable switched off")
    return [(Scalar(graph, one), Scalar(graph, other)) for one, other in nodes.reshape(-1, 2).tolist()]


@rule("random_wrap", "random_unwrap", reads="impl")
def _same(equation: Equation, key_nodes: Nodes) -> Nodes:
    if str(equation.params.get("impl", "fry")) != "fry":
        raise Unsupported(f"random numbers of kind {equation.params['impl']}")
    return key_nodes


@rule("random_seed", reads="impl")
def _seed(equation: Equation, seeds: Nodes) -> Nodes:
    """The two halves of a number of 64 bits; of 32 bits the first one is nothing."""
    words = []
    for node in seeds.ravel().tolist():
        seed = Scalar(equation.graph, node)
        wide = seed.to("bits", "u" + seed.type.removeprefix("u"))
        high = (wide >> 32).to("convert", U32).node if wide.type == U64 else equation.constant(0)
        words.append((high, wide.to("convert", U32).node))
    return _same(equation, np.array(words, dtype=np.int64).reshape(*seeds.shape, 2))


@rule("random_fold_in")
def _fold_in(equation: Equation, key_nodes: Nodes, data: Nodes) -> Nodes:
    graph = equation.graph
    keys, numbers = _keys(graph, key_nodes), data.ravel().tolist()
    zero = Scalar(graph, graph.constant(0, U32))
    words = [threefry(key, (zero, Scalar(graph, node))) for key, node in zip(keys, numbers, strict=True)]
    return _nodes(words).reshape(key_nodes.shape)


def _counted(graph: Graph, key_nodes: Nodes, shape: Sequence[int]) -> list[tuple[Scalar, Scalar]]:
    """Two words for each entry of an array, for each key."""
    count = [(graph.constant(i >> 32, U32), graph.constant(i & 0xFFFFFFFF, U32)) for i in range(int(np.prod(shape)))]
    pairs = [(Scalar(graph, high), Scalar(graph, low)) for high, low in count]
    return [threefry(key, pair) for key in _keys(graph, key_nodes) for pair in pairs]


@rule("random_split", reads="shape")
def _split(equation: Equation, key_nodes: Nodes) -> Nodes:
    words = _counted(equation.graph, key_nodes, equation.params["shape"])
    return _nodes(words).reshape(*key_nodes.shape[:-1], *equation.params["shape"], 2)


@rule("random_bits", reads="shape bit_width")
def _bits(equation: Equation, key_nodes: Nodes) -> Nodes:
    words, width = _counted(equation.graph, key_nodes, equation.params["shape"]), equation.params["bit_width"]
    if width == 64:
        made = [(one.to("convert", U64) << 32) | other.to("convert", U64) for one, other in words]
    elif width == 32:
        made = [one ^ other for one, other in words]
    else:
        raise Unsupported(f"random numbers of {width} bits")
    return np.array([entry.node for entry in made], dtype=np.int64).reshape(equation.shape)


def _nodes(words: list[tuple[Scalar, Scalar]]) -> Nodes:
    return np.array([[one.node, other.node] for one, other in words], dtype=np.int64)
