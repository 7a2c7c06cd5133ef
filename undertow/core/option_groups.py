"""Options that several functions have, declared once: a group is an object inside, and flat for whoever calls."""

import dataclasses
import functools
import inspect
import re
from collections.abc import Callable
from typing import Any, TypeVar, get_type_hints

Part = TypeVar("Part")


@dataclasses.dataclass(frozen=True)
class OptionGroup:
    """A group of options; its docstring says in `Attributes:` what each means."""


def flat_options(*without: str) -> Callable[[Callable[..., Part]], Callable[..., Part]]:
    """Decorate a function whose keyword arguments have groups as defaults: callers give the options of a group by name.

    Signature and docstring have them, too, so that scenarios, `undertow describe` and tuning see no difference. An
    option that the docstring explains itself keeps that text.

    Args:
        without: options of the groups that the function does not have; they stay as the default of the group has them.
    """

    def decorate(function: Callable[..., Part]) -> Callable[..., Part]:
        parameters = list(inspect.signature(function).parameters.values())
        groups = {
            parameter.name: parameter.default for parameter in parameters if isinstance(parameter.default, OptionGroup)
        }
        options = {name: _options_of(group, without) for name, group in groups.items()}

        @functools.wraps(function)
        def flat(*arguments: Any, **keywords: Any) -> Part:
            for name, group in groups.items():
                group_options = {option: keywords.pop(option) for option in options[name] if option in keywords}
                keywords[name] = dataclasses.replace(keywords.get(name, group), **group_options)
            return function(*arguments, **keywords)

        hints = get_type_hints(function, include_extras=True)
        flat_parameters: list[inspect.Parameter] = []
        for parameter in parameters:
            annotated = parameter.replace(annotation=hints.get(parameter.name, parameter.annotation))
            flat_parameters += options[parameter.name].values() if parameter.name in groups else [annotated]
        set_signature(
            flat, inspect.Signature(flat_parameters, return_annotation=hints.get("return", inspect.Signature.empty))
        )
        for name, group in groups.items():
            flat.__doc__ = _explained(flat.__doc__ or "", group, options[name])
        return flat

    return decorate


def set_signature(function: Callable[..., Any], signature: inspect.Signature) -> None:
    """Let a function have a signature, also for those who read its annotations."""
    function.__signature__ = signature  # type: ignore[attr-defined] - `inspect` reads it where it is there
    annotations = {parameter.name: parameter.annotation for parameter in signature.parameters.values()}
    annotations["return"] = signature.return_annotation
    function.__annotations__ = {
        name: annotation for name, annotation in annotations.items() if annotation is not inspect.Signature.empty
    }


def _options_of(group: OptionGroup, without: tuple[str, ...]) -> dict[str, inspect.Parameter]:
    """The options of a group as keyword arguments, with the values of the group as defaults."""
    hints = get_type_hints(type(group), include_extras=True)
    names = [field.name for field in dataclasses.fields(group) if field.name not in without]
    kind = inspect.Parameter.KEYWORD_ONLY
    return {name: inspect.Parameter(name, kind, default=getattr(group, name), annotation=hints[name]) for name in names}


def _explained(text: str, group: OptionGroup, options: dict[str, inspect.Parameter]) -> str:
    """A docstring with the options of a group at the end of `Args:`, but for those that it explains itself."""
    attributes = inspect.getdoc(type(group)) or ""
    entries = re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", attributes.partition("Attributes:\n")[2], re.MULTILINE)
    lines = [f"        {name}: {meaning.replace(chr(10), chr(10) + '    ')}" for name, meaning in entries]
    missing = [
        line
        for line, (name, _) in zip(lines, entries, strict=True)
        if name in options and not re.search(rf"^ +{name}: ", text, re.MULTILINE)
    ]
    head, section, following = text.partition("    Args:\n")
    arguments, gap, after = following.partition("\n\n")
    return "\n".join([head + section + arguments, *missing]) + gap + after
