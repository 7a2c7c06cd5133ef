"""Declaration of a parameter with its unit, symbol, meaning and source."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike

from undertow.core.arrays import as_array

if TYPE_CHECKING:

    class Param:
        """For type checkers: a field `name: Float[Param, "3"] = param(...)` takes numbers and gives an array."""

        @overload
        def __get__(self, instance: None, owner: Any) -> "Param": ...
        @overload
        def __get__(self, instance: object, owner: Any) -> Array: ...
        def __get__(self, instance: Any, owner: Any) -> Any: ...
        def __set__(self, instance: object, value: ArrayLike | Sequence[Any] | None) -> None: ...

    class Sources:
        """The same of a field of sources: a mapping in, pairs out."""

        def __get__(self, instance: Any, owner: Any) -> tuple[tuple[str, str], ...]: ...
        def __set__(self, instance: object, value: Mapping[str, str] | tuple[tuple[str, str], ...]) -> None: ...

else:
    Param, Sources = Array, tuple


class Parameter(NamedTuple):
    """One parameter of a part, as `undertow describe`, the docs and the result files show it."""

    name: str
    value: Any
    unit: str
    meaning: str
    symbol: str
    source: str


def param(
    unit: str,
    meaning: str,
    *,
    symbol: str = "",
    source: str = "",
    default: Any = dataclasses.MISSING,
    range: tuple[float, float] | None = None,
) -> Any:
    """Field of an `eqx.Module` that holds an array.

    Values are converted to arrays on construction, so that a changed number never causes a recompilation.

    Args:
        unit: SI unit, "" for a pure number.
        meaning: a few words.
        symbol: letter in the literature.
        source: where the default comes from; a part's own `sources` takes precedence.
        default: value when none is given; None for a parameter that may be left out, and is then not listed.
        range: bounds between which `undertow tune` searches, on a logarithmic scale; None if it is not tuned.
    """
    metadata = {"unit": unit, "meaning": meaning, "symbol": symbol, "source": source, "range": range}
    extra = {} if default is dataclasses.MISSING else {"default": default}
    return eqx.field(converter=as_array if default is not None else _as_array_or_none, metadata=metadata, **extra)


def sources_field() -> Any:
    """Field for {parameter name: source}; "*" stands for every parameter not named."""
    return eqx.field(static=True, default=(), converter=_freeze)


def parameters(part: eqx.Module | type, prefix: str = "") -> Iterator[Parameter]:
    """Every declared parameter of a part (values) or of a class (defaults), nested parts included."""
    sources = dict(getattr(part, "sources", ()) or ()) if not isinstance(part, type) else {}
    for field in dataclasses.fields(part):
        name = f"{prefix}{field.name}"
        if isinstance(part, type):
            value = "required" if field.default is dataclasses.MISSING else field.default
        else:
            value = getattr(part, field.name)
        if value is None:
            continue
        if "unit" in field.metadata:
            meta = field.metadata
            source = sources.get(field.name, sources.get("*", "")) or meta["source"]
            plain_value = value if isinstance(value, str) else np.asarray(value).tolist()
            yield Parameter(name, plain_value, meta["unit"], meta["meaning"], meta["symbol"], source)
        elif isinstance(value, eqx.Module):
            yield from parameters(value, f"{name}.")
        elif isinstance(value, tuple):
            fields = getattr(value, "_fields", None)
            for i, member in enumerate(value):
                if isinstance(member, eqx.Module):
                    yield from parameters(member, f"{name}.{fields[i]}." if fields else f"{name}[{i}].")


def tuning_ranges(part: eqx.Module) -> dict[str, tuple[float, float]]:
    """Bounds of the parameters of a part that are declared with a `range`, by name."""
    declared = {field.name: field.metadata.get("range") for field in dataclasses.fields(part)}
    return {name: bounds for name, bounds in declared.items() if bounds is not None}


def _as_array_or_none(value: Any) -> Any:
    return None if value is None else as_array(value)


def _freeze(sources: Mapping[str, str] | tuple) -> tuple:
    return tuple(sources.items()) if isinstance(sources, Mapping) else tuple(sources)
