"""What is installed, and whether this process has loaded code of anybody else. Imports no JAX."""

import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import site
import sys
import sysconfig
from pathlib import Path

from undertow.core.process_setup import KEEP_PROGRAMS, processor

_LIBRARIES = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "scipy", "jaxtyping")


def may_keep() -> bool:
    """Whether compiled programs may be kept for later processes.

    Not beside code of others, which may have changed what a program computes, unless it has said that it does not.
    """
    return os.environ.get(KEEP_PROGRAMS) == "1" or not foreign_modules()


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
def installation() -> tuple[str, ...]:
    """The sources of undertow and of its compiler, versions of Python and of libraries, and the kind of processor."""
    sources = hashlib.sha256()
    compiler = importlib.util.find_spec("simdjit")
    for package in (Path(__file__).parents[1], *(compiler.submodule_search_locations or () if compiler else ())):
        for path in sorted(Path(package).rglob("*.py")):
            contents = path.read_bytes()
            sources.update(f"{path.relative_to(package)} {len(contents)}\n".encode() + contents)
    versions = [f"{library} {importlib.metadata.version(library)}" for library in _LIBRARIES]
    return sources.hexdigest(), sys.version, *versions, processor()
