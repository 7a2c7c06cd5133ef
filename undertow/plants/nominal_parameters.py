"""What a controller is told of a plant's parameters: the truth, but for what a scenario says."""

from dataclasses import replace
from typing import Any, TypeVar

import equinox as eqx

Part = TypeVar("Part", bound=eqx.Module)


def nominal(truth: Part, **told: Any) -> Part:
    """The same part with other values of the named parameters; None leaves the true one."""
    return replace(truth, **{name: value for name, value in told.items() if value is not None})
