"""A name of traced functions by what they compute: the same name, the same program. A program is then lowered once."""

import enum
import functools
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal

from simdjit.rules import parameters_read


class Nameless(Exception):
    """Something whose contents do not say whether it equals another one."""


def fingerprint(functions: Sequence[ClosedJaxpr], *further: Any) -> str | None:
    """Name of a program; None where it cannot have one.

    Args:
        functions: as JAX traced them; what no rule reads (names, hints) is left out.
        further: what else the program depends on: numbers, text, arrays, tuples of them.
    """
    try:
        read: Any = (_version(), bool(jax.config.jax_threefry_partitionable), *functions, *further)  # pyright: ignore[reportAttributeAccessIssue]
        return _Names().of(read).hex()
    except Nameless:
        return None


def fingerprint_of_part(
    closed: ClosedJaxpr, arguments: Sequence[int], results: Sequence[int], *further: Any
) -> str | None:
    """Name of what a traced function computes of some arguments, which all of its equations go by, for some results.

    Args:
        closed: as JAX traced it.
        arguments, results: their places.
        further: as in `fingerprint`.
    """
    jaxpr = closed.jaxpr
    invars, outvars = [jaxpr.invars[i] for i in arguments], [jaxpr.outvars[i] for i in results]
    try:
        names = _Names()
        part = names.equations(jaxpr, invars, outvars)
        return names.of((_version(), bool(jax.config.jax_threefry_partitionable), part, *closed.consts, *further)).hex()  # pyright: ignore[reportAttributeAccessIssue]
    except Nameless:
        return None


@functools.cache
def _version() -> str:
    """Of what makes the program: the compiler's own code, and JAX, whose functions it calls while it lowers."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    if not sources:
        raise Nameless("the compiler's own code cannot be read")
    digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in sources]
    return " ".join((jax.__version__, np.__version__, *digests))


class _Names:
    """Names of values; those of jaxprs, which are used many times, are kept."""

    def __init__(self) -> None:
        self._kept: dict[int, tuple[Any, bytes]] = {}

    def of(self, value: Any) -> bytes:
        if isinstance(value, ClosedJaxpr | Jaxpr):  # one class in later versions of JAX
            body = self._body(value.jaxpr if isinstance(value, ClosedJaxpr) else value)
            return _digest("function", body, *map(self.of, getattr(value, "consts", ())))
        if value is None or isinstance(value, bool | int | float | complex | str | bytes):
            return _digest(type(value).__name__, repr(value))
        if isinstance(value, np.ndarray | np.generic | jax.Array):
            return _array(value)
        if isinstance(value, np.dtype | type):
            return _digest("type", str(np.dtype(value)))
        if isinstance(value, enum.Enum):
            return _digest("enum", f"{type(value).__qualname__}.{value.name}")
        # These have no public names: a generator of random numbers, and how the operands of a loop are grouped.
        if type(value).__name__ in ("PRNGImpl", "FTTuple"):
            return _digest(type(value).__name__, str(value))
        if isinstance(value, tuple | list):
            return _digest(type(value).__qualname__, *map(self.of, value))
        if isinstance(value, Mapping):
            return _digest("mapping", *(part for pair in value.items() for part in map(self.of, pair)))
        raise Nameless(f"a value of type {type(value).__qualname__}")

    def _body(self, jaxpr: Jaxpr) -> bytes:
        if id(jaxpr) not in self._kept:
            self._kept[id(jaxpr)] = (jaxpr, self.equations(jaxpr, jaxpr.invars, jaxpr.outvars))
        return self._kept[id(jaxpr)][1]

    def equations(self, jaxpr: Jaxpr, arguments: Sequence[Any], results: Sequence[Any]) -> bytes:
        """All equations of a function, of these arguments and for these results."""
        numbers: dict[Any, int] = {}

        def new(variables: Sequence[Any]) -> str:
            numbers.update(zip(variables, range(len(numbers), len(numbers) + len(variables)), strict=True))
            return ", ".join(str(variable.aval) for variable in variables)

        def used(variables: Sequence[Any]) -> list[str | bytes]:
            return [
                _literal(variable) if isinstance(variable, Literal) else str(numbers[variable])
                for variable in variables
            ]

        parts: list[str | bytes] = [new(arguments), new(jaxpr.constvars)]
        for equation in jaxpr.eqns:
            name, params = equation.primitive.name, equation.params
            read = parameters_read(name)
            if read is None:
                raise Nameless(f"primitive {name}, for which there is no rule")
            parts += [name, *used(equation.invars)]
            # One that no rule knows is refused by `rules` unless it is None.
            parts += [part for key in params if key in read for part in (key, self.of(params[key]))]
            parts += [key for key in params if params[key] is not None]
            parts.append(new(equation.outvars))
        return _digest("jaxpr", *parts, *used(results))


def _literal(literal: Literal) -> bytes:
    aval: Any = literal.aval
    return _array(np.asarray(literal.val, dtype=aval.dtype))


def _array(value: Any) -> bytes:
    if jnp.issubdtype(value.dtype, jax.dtypes.extended):
        raise Nameless(f"an array of type {value.dtype}")
    array = np.asarray(value)
    return _digest("array", str(array.dtype), str(array.shape), array.tobytes())


def _digest(kind: str, *parts: str | bytes) -> bytes:
    """Of parts in order; the length of each stands before it, so that no two lists of parts give the same bytes."""
    digest = hashlib.sha256(kind.encode() + b"\0")
    for part in parts:
        text = part.encode() if isinstance(part, str) else part
        digest.update(len(text).to_bytes(8, "little") + text)
    return digest.digest()
