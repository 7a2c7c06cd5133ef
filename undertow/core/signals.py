"""Signals that a part declares for recording."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from undertow.core.errors import BadInput
from undertow.core.user_code import place_of


class Signal(NamedTuple):
    """One recorded signal.

    Attributes:
        dimensions: names of its dimensions; `axis` runs over the outputs, `actuator` over the inputs, others are the
            part's own; () for a number.
        unit: in which `[axis]` stands for the unit of each output and `[input]` for that of the inputs; `1` for none.
        meaning: in words.
    """

    dimensions: tuple[str, ...]
    unit: str
    meaning: str

    def unit_for(self, output_units: Iterable[str], input_unit: str) -> str:
        """Unit of this signal of a plant; the units of all axes where they differ."""
        units = dict.fromkeys(self.unit.replace("[axis]", unit) for unit in output_units)
        return ", ".join(units).replace("[input]", input_unit)


def check_declared(part: Any, values: Mapping[str, Any], method: str) -> None:
    """Check that a part gives the signals that it declares; names only, so it costs nothing in compiled code.

    Args:
        part: a plant or a controller.
        values: of its signals, by name.
        method: of the part that gives them.

    Raises:
        BadInput: a signal is undeclared, or a declared one is missing, or the declarations are none.
    """
    declared, who = part.signals(), type(part).__name__
    if not (isinstance(declared, Mapping) and all(isinstance(signal, Signal) for signal in declared.values())):
        message = f"`{who}.signals` must return a mapping of names to `Signal`, but returns {declared!r}"
        raise BadInput("", "", message, hint="Return {} where there are none", where=place_of(part, "signals"))
    for name in values:
        if name not in declared:
            message = f"`{who}.{method}` gives a signal `{name}`, which `{who}.signals` does not declare"
            hint = f"Declare it: `signals` returns {{{name!r}: Signal(dimensions, unit, meaning), ...}}"
            raise BadInput("", "", message, hint=hint, where=place_of(part, "signals"))
    for name in declared:
        if name not in values:
            message = f"`{who}.signals` declares a signal `{name}`, which `{who}.{method}` does not give"
            hint = f"Give it among the signals of `{method}`, as {{{name!r}: value}}, or remove its declaration"
            raise BadInput("", "", message, hint=hint, where=place_of(part, "signals"))
