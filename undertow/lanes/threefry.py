"""Random numbers: the same bits as `jax.random` gives for a threefry key.

J. K. Salmon and others, Parallel random numbers: as easy as 1, 2, 3 (2011): Threefry-2x32 with 20 rounds.
"""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from undertow.lanes.graph import U32, U64, Graph
from undertow.lanes.scalar import Scalar

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


def _keys(graph: Graph, nodes: np.ndarray) -> list[tuple[Scalar, Scalar]]:
    """Keys of an array of them; their two words stand along its last axis."""
    return [(Scalar(graph, one), Scalar(graph, other)) for one, other in nodes.reshape(-1, 2).tolist()]


def _fold_in(graph: Graph, given: list[np.ndarray], params: dict[str, Any]) -> np.ndarray:
    keys, data = _keys(graph, given[0]), given[1].ravel().tolist()
    zero = Scalar(graph, graph.constant(0, U32))
    words = [threefry(key, (zero, Scalar(graph, node))) for key, node in zip(keys, data, strict=True)]
    return _nodes(words).reshape(given[0].shape)


def _counted(graph: Graph, given: list[np.ndarray], shape: Sequence[int]) -> list[tuple[Scalar, Scalar]]:
    """Two words for each entry of an array, for each key."""
    count = [(graph.constant(i >> 32, U32), graph.constant(i & 0xFFFFFFFF, U32)) for i in range(int(np.prod(shape)))]
    pairs = [(Scalar(graph, high), Scalar(graph, low)) for high, low in count]
    return [threefry(key, pair) for key in _keys(graph, given[0]) for pair in pairs]


def _split(graph: Graph, given: list[np.ndarray], params: dict[str, Any]) -> np.ndarray:
    words = _counted(graph, given, params["shape"])
    return _nodes(words).reshape(*given[0].shape[:-1], *params["shape"], 2)


def _bits(graph: Graph, given: list[np.ndarray], params: dict[str, Any]) -> np.ndarray:
    words = _counted(graph, given, params["shape"])
    if params["bit_width"] == 64:
        made = [(one.to("convert", U64) << 32) | other.to("convert", U64) for one, other in words]
    else:
        made = [one ^ other for one, other in words]
    nodes = np.array([entry.node for entry in made], dtype=np.int64)
    return nodes.reshape((*given[0].shape[:-1], *params["shape"]))


def _nodes(words: list[tuple[Scalar, Scalar]]) -> np.ndarray:
    return np.array([[one.node, other.node] for one, other in words], dtype=np.int64)


def available() -> bool:
    """Whether `jax.random` is set up to count entries the way this module does; it is unless told otherwise."""
    return bool(jax.config.jax_threefry_partitionable)  # pyright: ignore[reportAttributeAccessIssue]


# Keys are arrays of two words each.
RULES: dict[str, Callable[[Graph, list[np.ndarray], dict[str, Any]], np.ndarray]] = {
    "random_wrap": lambda graph, given, params: given[0],
    "random_unwrap": lambda graph, given, params: given[0],
    "random_fold_in": _fold_in,
    "random_split": _split,
    "random_bits": _bits,
}
