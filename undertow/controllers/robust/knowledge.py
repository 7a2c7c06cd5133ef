"""What a memory has learnt: kept in a file for the next run, and shown with names."""

import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from undertow.core import checks
from undertow.core.errors import BadInput

_DAMAGED = (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile, zlib.error)
_MUST = "be a file of `save_knowledge`"


def save_knowledge(path, run) -> None:
    """Write what was learnt by the end of a run to a file (.npz).

    Args:
        path: of the file.
        run: dataset with the signals `memory_weights` and `memory_variance`.
    """
    weights, variance = (run[name].values[-1] for name in ("memory_weights", "memory_variance"))
    np.savez(path, weights=weights, variance=variance)


def load_knowledge(path) -> tuple[Array, Array]:
    """Weights, (k, n), and variance, (k,), of a file of `save_knowledge`.

    Raises:
        BadInput: the file cannot be read, or holds something else.
    """
    try:
        with Path(path).open("rb") as file, np.load(file) as held:
            weights, variance = np.asarray(held["weights"], dtype=float), np.asarray(held["variance"], dtype=float)
    except _DAMAGED as error:
        raise BadInput("knowledge", _MUST, str(path)) from error
    if weights.ndim != 2 or variance.shape != weights.shape[:1]:
        got = f"{path} with weights of shape {weights.shape} and variance of shape {variance.shape}"
        raise BadInput("knowledge", _MUST, got)
    checks.finite("knowledge", weights)
    checks.finite("knowledge", variance)
    if (variance < 0).any() or (variance > 1 + 1e-9).any():
        raise BadInput(
            "knowledge", "have a variance from 0 to 1", f"{path} with {variance.min():g} to {variance.max():g}"
        )
    return jnp.asarray(weights), jnp.asarray(variance)


def regressor_names(axes: Sequence[str], rules: int, regressor: str, body: bool) -> list[str]:
    """Names of the entries of the regressor of a memory, in their order.

    Args:
        axes: names of the axes of the law.
        rules: fuzzy sets of each velocity.
        regressor: `rules`, `linear` or `both`.
        body: whether the plant is a body.
    """
    names = ["1", *(f"acceleration of {axis}" for axis in axes)]
    if regressor != "linear":
        places = [place for place in np.linspace(-1, 1, rules) if place]
        names += [f"rule of {axis} at {place:+.3g} of its range" for axis in axes for place in places]
    if regressor != "rules":
        names += [*axes, *(f"{axis} |{axis}|" for axis in axes)]
    if body:
        u, turning = axes[:3], axes[3:]
        names += [f"gravity along {axis}" for axis in u]
        pairs = [(u, u, 1), (turning, u, 1), (turning, u, 2)]
        names += [f"{one[i]} {other[(i + shift) % 3]}" for one, other, shift in pairs for i in range(3)]
    return names


class Learnt(NamedTuple):
    """One weight of a memory, with how much of its uncertainty is left."""

    axis: str
    regressor: str
    weight: float  # m/s^2, rad/s^2
    variance: float  # over that before learning: 1 where the motion did not excite it


def strongest(weights, variance, names: Sequence[str], axes: Sequence[str], count: int = 3) -> list[Learnt]:
    """The largest weights of each axis.

    Args:
        weights: (k, n), m/s^2 and rad/s^2.
        variance: (k,), relative.
        names: of the k entries of the regressor.
        axes: names of the n axes.
        count: how many of each axis.
    """
    order = np.argsort(-np.abs(np.asarray(weights)), axis=0)[:count]
    return [
        Learnt(axis, names[int(k)], float(weights[k, place]), float(variance[k]))
        for place, axis in enumerate(axes)
        for k in order[:, place]
    ]
