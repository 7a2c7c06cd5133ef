"""Random messages of any type of CycloneDDS, for comparisons."""

import dataclasses
from typing import get_type_hints

import numpy as np
from cyclonedds.idl import IdlStruct


def random_message(kind: type[IdlStruct], chance: np.random.Generator) -> IdlStruct:
    """A message whose every field is random: all finite numbers, texts with accents, sequences of any length."""
    hints = get_type_hints(kind, include_extras=True)
    return kind(**{field.name: _value(hints[field.name], chance) for field in dataclasses.fields(kind)})


def _value(hint, chance):
    if isinstance(hint, type) and issubclass(hint, IdlStruct):
        return random_message(hint, chance)
    if hint is str:
        return "".join(chance.choice(list("ab/_\u00e9\u6c340"), chance.integers(0, 9)))
    sort = hint.__metadata__[0]
    if sort == "float64":
        return float(chance.normal() * 10.0 ** chance.integers(-200, 200))
    if isinstance(sort, str):
        lowest, beyond = {"int32": (-(2**31), 2**31), "uint32": (0, 2**32)}[sort]
        return int(chance.integers(lowest, beyond))
    count = getattr(sort, "length", None) or int(chance.integers(0, 9))
    return [_value(sort.subtype, chance) for _ in range(count)]
