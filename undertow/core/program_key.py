"""Which compiled program a value needs, in this process or in a later one.

Its key is the structure of its arguments (`structure_key`), and with it the sources of undertow, the versions of all
libraries, the settings of JAX and the kind of processor.

Nothing is kept for later processes by one that has loaded code of anybody else, as a script, a notebook or a scenario
with a part of one's own has: it may have changed what a program computes.
"""

import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import site
import sys
import sysconfig
from pathlib import Path
from typing import Any

import jax
from jax.core import Tracer

from undertow.core.process_setup import processor
from undertow.core.runtime import current_precision
from undertow.core.structure_key import NoKey, structure_key

_LIBRARIES = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "scipy", "jaxtyping")

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
    try:
        return structure_key(*values, current_precision())
    except NoKey:
        return None


def kept_key(key: str) -> KeptKey | None:
    """A key of this process with what programs depend on beside their arguments: for all processes.

    None beside code of others.
    """
    if foreign_modules():
        return None
    settings = {
        name: value
        for name, value in jax.config.values.items()  # pyright: ignore[reportAttributeAccessIssue]
        if "cache" not in name and "log" not in name
    }
    return (key, *_installation(), os.environ.get("XLA_FLAGS", ""), sorted(settings.items(), key=repr))


def foreign_modules() -> list[str]:
    """Names of the loaded modules that are neither undertow's, nor Python's, nor of an installed package."""
    return _foreign_among(tuple(sys.modules))


@functools.lru_cache(1)
def _foreign_among(names: tuple[str, ...]) -> list[str]:
    return [name for name in names if _is_foreign(name)]


def _is_foreign(name: str) -> bool:
    file = getattr(sys.modules.get(name), "__file__", None)
    if file is None:
        return name == "__main__"  # of a terminal or a notebook; others are part of Python, or namespaces
    return not str(file).startswith(_trusted_folders())


@functools.cache
def _trusted_folders() -> tuple[str, ...]:
    """Where undertow, simdjit, Python, installed packages and the commands of packages are."""
    package = Path(__file__).parents[1]
    # Not the folder in which Python was installed: an environment may be made in the folder of a user's own code.
    paths = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib", "scripts")]
    folders = {str(package), str(package.parent / "simdjit" / "simdjit"), *paths, *site.getsitepackages()}
    folders |= {site.getusersitepackages()}
    return tuple(f"{folder}{os.sep}" for folder in folders if folder)


@functools.cache
def _installation() -> tuple[str, ...]:
    """The sources of undertow and of its compiler, versions of Python and of libraries, and the kind of processor."""
    sources = hashlib.sha256()
    compiler = importlib.util.find_spec("simdjit")
    for package in (Path(__file__).parents[1], *(compiler.submodule_search_locations or () if compiler else ())):
        for path in sorted(Path(package).rglob("*.py")):
            contents = path.read_bytes()
            sources.update(f"{path.relative_to(package)} {len(contents)}\n".encode() + contents)
    versions = [f"{library} {importlib.metadata.version(library)}" for library in _LIBRARIES]
    return sources.hexdigest(), sys.version, *versions, processor()
