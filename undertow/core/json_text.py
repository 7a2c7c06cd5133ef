"""Standard JSON, which has no number that is not finite."""

import json
import math
from typing import Any


def to_json(value: Any, indent: int | None = None) -> str:
    """Standard JSON: numbers that are not finite become null."""
    return json.dumps(finite_numbers(value), indent=indent, allow_nan=False)


def finite_numbers(value: Any) -> Any:
    """Nested dictionaries, lists and tuples with None in place of numbers that are not finite."""
    if isinstance(value, dict):
        return {key: finite_numbers(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite_numbers(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
