"""Compiled programs that are kept from one process to the next, and found again without tracing.

JAX keeps the machine code of a program, but traces and lowers its Python code in every process to find out which one
it needs: for a vehicle that takes a hundred times as long as to run it. Here the structure of the arguments says which
one it is (`structure_key`). With it belong the sources of undertow, the versions of all libraries, the settings of JAX
and the kind of processor.

Nothing is kept or found in a process that has loaded code of anybody else, as a script, a notebook or a scenario with a
part of one's own has: it may have changed what a program computes.
"""

import functools
import hashlib
import importlib.metadata
import os
import pickle
import secrets
import site
import sys
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
from jax.core import Tracer
from jax.experimental import serialize_executable

from undertow.core.process_setup import processor
from undertow.core.runtime import current_precision
from undertow.core.structure_key import NoKey, arrays_of, joined, structure_key
from undertow.simulation.loop import simd_batch

_LIBRARIES = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "scipy", "jaxtyping")


def kept_program(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a pure function of trees of parts, as `eqx.filter_jit` does, and keep its programs.

    Args:
        function: of positional arguments; its result is a tree of arrays. It may read nothing that changes but them.
    """
    compiled = eqx.filter_jit(function)
    programs: dict[str, _Program | None] = {}

    @functools.wraps(function)
    def run(*arguments: Any) -> Any:
        if not _may_keep(arguments):
            return compiled(*arguments)
        try:
            key = structure_key(function, arguments, current_precision())
        except NoKey:
            return compiled(*arguments)
        if key not in programs:
            programs[key] = _Program.of(function, arguments, key)
        program = programs[key]
        return compiled(*arguments) if program is None else program(arguments)

    return run


def kept_check(check: Callable[[], None], subject: Any) -> None:
    """Call a check of the structure of a tree of parts, unless it has passed for this structure in an earlier process.

    Args:
        check: raises an error unless the parts are right; numbers of arrays decide nothing.
        subject: what it checks.
    """

    def passed() -> bytes:
        check()
        return b"passed"

    try:
        key = structure_key(subject, current_precision()) if _may_keep(subject) else ""
    except NoKey:
        key = ""
    if key:
        simd_batch.kept_code(("check", key, *_process()), passed)
    else:
        check()


class _Program:
    """A compiled program: a list of arrays in, a list of arrays out, and the form of its result."""

    def __init__(self, executable: bytes, arguments: int, form: Any):
        takes = jax.tree.structure((([0] * arguments,), {}))
        gives = jax.tree.structure([0] * form.num_leaves)
        self._run = serialize_executable.deserialize_and_load(executable, takes, gives, "cpu")
        self._form = form

    @classmethod
    def of(cls, function: Callable[..., Any], arguments: Any, key: str) -> "_Program | None":
        """The program of a function for arguments of this structure; None where it cannot be kept."""
        contents = simd_batch.kept_code((key, *_process()), lambda: _made(function, arguments))
        try:
            return cls(*pickle.loads(contents)) if contents else None
        except Exception:  # whatever XLA, or another version of JAX, says of machine code that it does not take
            return None

    def __call__(self, arguments: Any) -> Any:
        return jax.tree.unflatten(self._form, self._run(arrays_of(arguments)[0]))


def _made(function: Callable[..., Any], arguments: Any) -> bytes:
    """The program and the form of its result; empty where its result is more than arrays, or it calls LAPACK."""
    arrays, rest = arrays_of(arguments)
    forms = []

    def of_arrays(arrays: list[Any]) -> list[Any]:
        results, further = eqx.partition(function(*joined(arrays, rest)), eqx.is_array)
        leaves, form = jax.tree.flatten(results)
        forms.append(None if jax.tree.leaves(further) else form)
        return leaves

    # XLA's own cache gives programs that cannot be kept once more: under a new name it has none.
    of_arrays.__name__ = f"{function.__name__}_{secrets.token_hex(8)}"
    lowered = jax.jit(of_arrays).lower(arrays)
    (form,) = forms
    # JAX gets LAPACK and other code outside of XLA ready when it lowers a call of it: a program that is found again
    # without that would jump to nowhere.
    if form is None or "custom_call" in lowered.as_text():
        return b""
    executable = lowered.compile()
    try:
        return pickle.dumps((serialize_executable.serialize(executable)[0], len(arrays), form))
    except Exception:  # constants of a program, or a form that has no name, cannot be kept
        return b""


def _may_keep(arguments: Any) -> bool:
    """Whether a program for these arguments may be kept: not for traced ones, nor beside code of others."""
    if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(arguments)):
        return False
    device = jax.config.jax_default_device  # pyright: ignore[reportAttributeAccessIssue]
    platform = jax.default_backend() if device is None else getattr(device, "platform", "")
    return platform == "cpu" and not simd_batch.unavailable() and not foreign_modules()


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


def _process() -> tuple[Any, ...]:
    """What a program depends on beside its arguments."""
    settings = {
        name: value
        for name, value in jax.config.values.items()  # pyright: ignore[reportAttributeAccessIssue]
        if "cache" not in name and "log" not in name
    }
    return (*_installation(), os.environ.get("XLA_FLAGS", ""), sorted(settings.items(), key=repr))


@functools.cache
def _installation() -> tuple[str, ...]:
    """The sources of undertow, versions of Python and of libraries, and the kind of processor."""
    sources = hashlib.sha256()
    package = Path(__file__).parents[1]
    for path in sorted(package.rglob("*.py")):
        contents = path.read_bytes()
        sources.update(f"{path.relative_to(package)} {len(contents)}\n".encode() + contents)
    versions = [f"{library} {importlib.metadata.version(library)}" for library in _LIBRARIES]
    return sources.hexdigest(), sys.version, *versions, processor()
