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
from undertow.core.atomic_io import replacing
from undertow.core.errors import BadInput

_DAMAGED = (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile, zlib.error)
_DAMAGED += (MemoryError, RuntimeError, NotImplementedError)  # an impossible shape, encryption, unknown compression
_LARGEST = 2_000_000  # numbers
_MUST = "be a file of `save_knowledge`"
# Entries of a file and the signals they come from.
_SIGNALS = {"weights": "memory_weights", "variance": "memory_variance", "inertia": "inertia"}
_ALWAYS = ("weights", "variance")


class Knowledge(NamedTuple):
    """What a memory has learnt, with n axes and k entries of the regressor."""

    weights: Array  # (k, n), m/s^2, rad/s^2
    variance: Array  # (k,), over that before learning, 0 to 1
    inertia: Array | None = None  # (n,), over that of the nominal model


def save_knowledge(path, run) -> None:
    """Write what was learnt by the end of a run to a file (.npz); one that was there stays until it is whole.

    Args:
        path: of the file.
        run: dataset with the signals `memory_weights` and `memory_variance`, and `inertia` where it was identified.

    Raises:
        OSError: the file cannot be written.
    """
    path = Path(path)
    path = path if path.suffix == ".npz" else path.with_name(f"{path.name}.npz")
    with replacing(path) as file:
        np.savez(file, **{name: run[signal].values[-1] for name, signal in _SIGNALS.items() if signal in run})


def load_knowledge(path) -> Knowledge:
    """What a file of `save_knowledge` holds.

    Raises:
        BadInput: the file cannot be read, or holds something else.
    """
    try:
        with Path(path).open("rb") as file, np.load(file) as held:
            _check_sizes(held.zip)
            raw = {name: held[name] for name in _SIGNALS if name in held or name in _ALWAYS}
            arrays = _real(raw)
    except _DAMAGED as error:
        raise BadInput("knowledge", _MUST, str(path)) from error
    weights, variance, inertia = arrays["weights"], arrays["variance"], arrays.get("inertia")
    good = weights.ndim == 2 and variance.shape == weights.shape[:1]
    if not good or (inertia is not None and inertia.shape != weights.shape[1:]):
        got = ", ".join(f"{name} of shape {value.shape}" for name, value in arrays.items())
        raise BadInput("knowledge", _MUST, f"{path} with {got}")
    for value in arrays.values():
        checks.finite("knowledge", value)
    if (variance < 0).any() or (variance > 1 + 1e-9).any():
        raise BadInput(
            "knowledge", "have a variance from 0 to 1", f"{path} with {variance.min():g} to {variance.max():g}"
        )
    if inertia is not None and (inertia <= 0).any():
        raise BadInput("knowledge", "have inertias above 0", str(path))
    return Knowledge(**{name: jnp.asarray(value) for name, value in arrays.items()})


def _check_sizes(archive: zipfile.ZipFile) -> None:
    if sum(member.file_size for member in archive.infolist()) > 8 * _LARGEST:
        raise ValueError("larger than any memory")


def _real(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Arrays as floating-point numbers, which take eight times the memory of bytes."""
    if any(values.dtype.kind not in "fiu" for values in arrays.values()):
        raise TypeError("not of real numbers")
    if sum(values.size for values in arrays.values()) > _LARGEST:
        raise ValueError("larger than any memory")
    return {name: np.asarray(values, dtype=float) for name, values in arrays.items()}


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
        centres = [centre for centre in np.linspace(-1, 1, rules) if centre]
        names += [f"rule of {axis} at {centre:+.3g} of its range" for axis in axes for centre in centres]
    if regressor != "rules":
        names += [*axes, *(f"{axis} |{axis}|" for axis in axes)]
    if body:
        u, turning = axes[:3], axes[3:]
        names += [f"gravity along {axis}" for axis in u]
        pairs = [(u, u, 1), (turning, u, 1), (turning, u, 2)]
        names += [f"{left[i]} {right[(i + shift) % 3]}" for left, right, shift in pairs for i in range(3)]
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
        Learnt(axis, names[int(k)], float(weights[k, column]), float(variance[k]))
        for column, axis in enumerate(axes)
        for k in order[:, column]
    ]
