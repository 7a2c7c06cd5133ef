"""A key of what decides a compiled program: types, static values and shapes, without the numbers of arrays.

Two values with the same key give the same program, in any process. What may differ without a trace has no key: code of
anybody but undertow and the libraries it names, and objects whose contents are hidden.
"""

import dataclasses
import enum
import functools
import hashlib
import sys
import types
import weakref
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

# Packages whose code is known by their versions, or by the hash of their sources.
_KNOWN = {"undertow", "simdjit", "jax", "jaxlib", "numpy", "equinox", "diffrax", "builtins", "functools", "operator"}


# Descriptions of modules that live, by identity and by whether the numbers of arrays count.
_DESCRIBED: dict[tuple[int, bool], str] = {}


def _keep(module: eqx.Module, static: bool, description: str) -> None:
    key = id(module), static
    _DESCRIBED[key] = description
    weakref.finalize(module, _DESCRIBED.pop, key, None).atexit = False


class NoKey(Exception):
    """A value about which nobody can say whether it equals another one."""


class Constant(NamedTuple):
    """A value of which the numbers of arrays count, because they are constants of the program."""

    value: Any


def structure_key(*values: Any) -> str:
    """Key of the structure of values.

    Args:
        values: trees of parts. Of arrays of JAX type and shape count, but in static fields their numbers.

    Raises:
        NoKey: something in them has none.
    """
    description = _Description()
    description.add(values, static=False)
    return hashlib.sha256("".join(description.parts).encode()).hexdigest()


class _Description:
    """Describes values so that no two different structures give the same text: each has its kind and its length."""

    def __init__(self) -> None:
        self.parts: list[str] = []
        self._inside: list[int] = []  # identities of what is being described
        self._circular = False

    def add(self, value: Any, static: bool) -> None:
        """Describe a value; `static` where the numbers of arrays count."""
        if value is None or value is ... or isinstance(value, bool | int | float | complex | str | bytes | slice):
            self._text(type(value).__name__, repr(value))
        elif isinstance(value, jax.Array):
            self._array(value, static)
        elif isinstance(value, np.ndarray | np.generic):
            self._array(np.asarray(value), static=True)
        elif id(value) in self._inside:
            self._circular = True
            self._text("again", str(self._inside.index(id(value))))
        elif isinstance(value, eqx.Module):
            self._module(value, static)
        else:
            self._inside.append(id(value))
            self._compound(value, static)
            self._inside.pop()

    def _module(self, module: eqx.Module, static: bool) -> None:
        """A module cannot be changed, so its description is kept as long as it lives."""
        known = _DESCRIBED.get((id(module), static))
        if known is not None:
            self.parts.append(known)
            return
        first = len(self.parts)
        self._inside.append(id(module))
        self._dataclass(module, static)
        self._inside.pop()
        if not self._circular:
            _keep(module, static, "".join(self.parts[first:]))

    def _text(self, kind: str, text: str) -> None:
        self.parts.append(f"{kind} {len(text)} {text}\n")

    def _array(self, array: Any, static: bool) -> None:
        is_extended, dtype = _type(array.dtype)
        if is_extended:
            if static:
                raise NoKey(f"a static array of type {dtype}")
            self._text("array", f"{dtype} {array.shape}")
            return
        weak = getattr(array, "weak_type", False)
        self._text("array", f"{dtype} {array.shape} {weak} {type(array).__name__ if static else ''}")
        if static:
            self._text("numbers", np.asarray(array).tobytes().hex())

    def _compound(self, value: Any, static: bool) -> None:
        if isinstance(value, enum.Enum):
            self._reference(type(value))
            self._text("member", value.name)
        elif isinstance(value, type):
            self._reference(value)
        elif isinstance(value, functools.partial):
            self._entries("partial", (value.func, value.args, dict(value.keywords)), static)
        elif isinstance(value, Constant):
            self._entries("constant", tuple(value), static=True)
        elif isinstance(value, tuple | list):
            self._reference(type(value))
            self._entries("entries", tuple(value), static)
        elif isinstance(value, Mapping):
            self._reference(type(value))
            self._entries("mapping", tuple(entry for pair in value.items() for entry in pair), static)
        elif isinstance(value, set | frozenset):
            self._entries("set", tuple(sorted(value, key=repr)), static)
        elif dataclasses.is_dataclass(value):
            self._dataclass(value, static)
        elif isinstance(value, types.MethodType):  # no tree: what it is bound to becomes a constant of a program
            self._entries("method", (value.__func__, value.__self__), static=True)
        elif isinstance(value, types.FunctionType):
            self._function(value)
        elif type(value).__name__ == "HashablePartial":  # what `ravel_pytree` gives; it has no public name
            self._entries("partial", (value.f, value.args, value.kwargs), static=True)
        elif isinstance(value, np.dtype):
            self._text("dtype", str(value))
        elif isinstance(value, jax.tree_util.PyTreeDef):
            self._entries("tree", (jax.tree.unflatten(value, range(value.num_leaves)),), static=True)
        else:
            self._named(value)

    def _entries(self, kind: str, entries: tuple[Any, ...], static: bool) -> None:
        self._text(kind, str(len(entries)))
        for entry in entries:
            self.add(entry, static)

    def _dataclass(self, value: Any, static: bool) -> None:
        self._reference(type(value))
        for name, always_static in _fields(type(value)):
            self._text("field", name)
            if hasattr(value, name):
                self.add(getattr(value, name), static or always_static)

    def _function(self, function: types.FunctionType) -> None:
        """Arrays that a function closes over are constants of a program that calls it."""
        self._text("function", f"{_known(function)}.{function.__qualname__}")
        self._code(function.__code__)
        try:
            cells = tuple(cell.cell_contents for cell in function.__closure__ or ())
        except ValueError:
            raise NoKey(f"{function.__qualname__} closes over what is not there yet") from None
        self._entries("closure", cells, static=True)
        self._entries("defaults", (function.__defaults__, function.__kwdefaults__), static=True)

    def _code(self, code: types.CodeType) -> None:
        """Instructions and constants: two functions may have the same name and line."""
        self._text("code", f"{code.co_firstlineno} {code.co_code.hex()} {code.co_names}")
        for constant in code.co_consts:
            self._code(constant) if isinstance(constant, types.CodeType) else self.add(constant, static=True)

    def _reference(self, kind: type) -> None:
        self._text("class", f"{_known(kind)}.{kind.__qualname__}")
        if "<locals>" in kind.__qualname__:
            raise NoKey(f"a class made inside a function: {kind.__qualname__}")

    def _named(self, value: Any) -> None:
        """Something that its module has under its name: a function of C, or one that JAX has wrapped."""
        name = getattr(value, "__name__", None) or getattr(value, "name", None)
        module = sys.modules.get(_known(value))
        if not isinstance(name, str) or getattr(module, name, None) is not value:
            raise NoKey(f"an object of type {type(value).__qualname__}")
        self._text("named", f"{_known(value)}.{name}")


@functools.cache
def _type(dtype: Any) -> tuple[bool, str]:
    """Whether a type of numbers is one of JAX's own, as that of random keys; and its name."""
    return jnp.issubdtype(dtype, jax.dtypes.extended), str(dtype)


@functools.cache
def _fields(kind: type) -> tuple[tuple[str, bool], ...]:
    """Name of each field of a dataclass, and whether it is static."""
    return tuple((field.name, field.metadata.get("static", False)) for field in dataclasses.fields(kind))


def _known(value: Any) -> str:
    """The module of a function or class, where its code is known.

    Raises:
        NoKey: it is somebody else's.
    """
    module = getattr(value, "__module__", None) or ""
    if module.partition(".")[0] not in _KNOWN:
        raise NoKey(f"code of {module or type(value).__qualname__}")
    return module


def arrays_of(values: Any) -> tuple[list[jax.Array], Any]:
    """The arrays of JAX in a tree, and the tree without them; `joined` puts arrays there again."""
    dynamic, static = eqx.partition(values, eqx.is_array)
    arrays, form = jax.tree.flatten(dynamic)
    return arrays, (form, static)


def joined(arrays: list[Any], rest: Any) -> Any:
    """The tree that `arrays_of` took apart, with other arrays."""
    form, static = rest
    return eqx.combine(jax.tree.unflatten(form, arrays), static)
