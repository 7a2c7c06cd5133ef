"""Which compiled program a value needs, in this process or in a later one.

Its key is the structure of its arguments (`structure_key`), and with it the sources of undertow, the versions of all
libraries, the settings of JAX and the kind of processor.

Nothing is kept for later processes by one that has loaded code of anybody else, as a script, a notebook or a scenario
with a part of one's own has, unless that says that it changes nothing of undertow (`prepare`).
"""

import os
from typing import Any

import jax
from jax.core import Tracer

from undertow.core.installation import installation, may_keep
from undertow.core.runtime import current_precision
from undertow.core.structure_key import NoKey, structure_key

# Two processes with the same one may use each other's programs.
KeptKey = tuple[Any, ...]


def program_key(*values: Any) -> str | None:
    """Key, in this process, of the program that trees of parts need.

    None where nothing tells: for traced values, for a program that is not for this processor, and for values whose
    contents are hidden.
    """
    if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(values)):
        return None
    device = jax.config.jax_default_device  # pyright: ignore[reportAttributeAccessIssue]
    platform = jax.default_backend() if device is None else getattr(device, "platform", "")
    if platform != "cpu":
        return None
    random_numbers = bool(jax.config.jax_threefry_partitionable)  # pyright: ignore[reportAttributeAccessIssue]
    try:
        return structure_key(*values, current_precision(), random_numbers)
    except NoKey:
        return None


def kept_key(key: str) -> KeptKey | None:
    """A key of this process with what programs depend on beside their arguments: for all processes.

    None beside code of others.
    """
    if not may_keep():
        return None
    settings = {
        name: value
        for name, value in jax.config.values.items()  # pyright: ignore[reportAttributeAccessIssue]
        if "cache" not in name and "log" not in name
    }
    return (key, *installation(), os.environ.get("XLA_FLAGS", ""), sorted(settings.items(), key=repr))
