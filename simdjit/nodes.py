"""Arrays of nodes, one for each scalar of an array."""

from collections.abc import Sequence

import numpy as np

from simdjit.graph import Node

Nodes = np.ndarray


def filled(shape: Sequence[int], nodes: Sequence[Node]) -> Nodes:
    """An array of nodes in their order."""
    return np.array(nodes, dtype=np.int64).reshape(shape)


def flat(several: Sequence[Nodes]) -> list[Node]:
    """All nodes of some arrays, one after another."""
    return [node for nodes in several for node in nodes.ravel().tolist()]
