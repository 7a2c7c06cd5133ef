"""JAX's primitives that only move entries: NumPy does the same with arrays of nodes."""

from collections.abc import Callable
from typing import Any

import numpy as np


def _slice(given: list[np.ndarray], params: dict[str, Any], out: Any) -> np.ndarray:
    strides = params["strides"] or [1] * given[0].ndim
    cuts = zip(params["start_indices"], params["limit_indices"], strides, strict=True)
    return given[0][tuple(slice(*cut) for cut in cuts)]


def _broadcast(given: list[np.ndarray], params: dict[str, Any], out: Any) -> np.ndarray:
    shape = [1] * len(out.shape)
    for size, axis in zip(given[0].shape, params["broadcast_dimensions"], strict=True):
        shape[axis] = size
    return np.broadcast_to(given[0].reshape(shape), out.shape)


def _split(given: list[np.ndarray], params: dict[str, Any], out: Any) -> list[np.ndarray]:
    return np.split(given[0], np.cumsum(params["sizes"])[:-1], axis=params["axis"])


def _reshape(given: list[np.ndarray], params: dict[str, Any], out: Any) -> np.ndarray:
    return given[0].reshape(out.shape)


RULES: dict[str, Callable[[list[np.ndarray], dict[str, Any], Any], Any]] = {
    "reshape": _reshape,
    "squeeze": _reshape,
    "expand_dims": _reshape,
    "broadcast_in_dim": _broadcast,
    "slice": _slice,
    "split": _split,
    "transpose": lambda given, params, out: given[0].transpose(params["permutation"]),
    "concatenate": lambda given, params, out: np.concatenate(given, axis=params["dimension"]),
    "stack": lambda given, params, out: np.stack(given, axis=params["axis"]),
    "unstack": lambda given, params, out: list(np.moveaxis(given[0], params["axis"], 0)),
    "rev": lambda given, params, out: np.flip(given[0], params["dimensions"]),
}
