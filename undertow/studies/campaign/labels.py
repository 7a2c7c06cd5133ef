"""Labels of the values that a campaign sweeps or chooses."""

from typing import Any


def by_name(values: list[Any]) -> dict[str, Any]:
    """Values by unique names: the kind and preset of a part where these are unique, otherwise all its options."""
    short = [_short(value) for value in values]
    names = [name if short.count(name) == 1 else words(value) for name, value in zip(short, values, strict=True)]
    unique = [name if names.count(name) == 1 else f"{name} {i + 1}" for i, name in enumerate(names)]
    return dict(zip(unique, values, strict=True))


def is_number(value: Any) -> bool:
    """Whether a value of a scenario is a number; booleans are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _short(value: Any) -> str:
    if isinstance(value, dict) and "kind" in value:
        return " ".join(str(value[key]) for key in ("kind", "preset") if key in value)
    return words(value)


def words(value: Any) -> str:
    """A value of a scenario in one line; a part by its kind and options."""
    if isinstance(value, dict):
        kind = [str(value["kind"])] if "kind" in value else []
        return " ".join(kind + [f"{key}={words(option)}" for key, option in value.items() if key != "kind"])
    if isinstance(value, list):
        return f"[{', '.join(map(words, value))}]"
    return str(value)
