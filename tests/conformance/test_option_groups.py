"""Options that several functions share: flat for the caller, an object inside."""

import dataclasses
import inspect
from typing import Annotated, Any

import pytest

from undertow.core import catalogue
from undertow.core.option_groups import OptionGroup, flat_options
from undertow.scenario.describing import options_of


@dataclasses.dataclass(frozen=True)
class Weather(OptionGroup):
    """Weather.

    Attributes:
        wind: speed, m/s; and
            gusts, too.
        rain: mm.
        sun: hours.
    """

    wind: float = 1.0
    rain: Any = None
    sun: float = 8.0


@flat_options("sun")
def sail(boat: str, *, weather: Weather = Weather(rain=2), sailors: Annotated[int, "people"] = 1) -> tuple:
    """Sail.

    Args:
        boat: name.
        sailors: number.
        rain: of today.

    Raises:
        BadInput: never.
    """
    return boat, weather, sailors


def test_options_are_given_by_name():
    assert sail("Ida", wind=3.0) == ("Ida", Weather(3.0, 2), 1)
    assert sail("Ida", sailors=2, rain=0) == ("Ida", Weather(1.0, 0), 2)
    assert sail("Ida", weather=Weather(5.0), rain=1) == ("Ida", Weather(5.0, 1), 1)


def test_what_is_no_option_is_none():
    for unknown in ({"sun": 1.0}, {"snow": 1.0}):
        with pytest.raises(TypeError, match="unexpected keyword argument"):
            sail("Ida", **unknown)


def test_signature_and_docstring_have_them():
    options = list(inspect.signature(sail).parameters.values())[1:]
    assert [(option.name, option.default) for option in options] == [("wind", 1.0), ("rain", 2), ("sailors", 1)]
    people = Annotated[int, "people"]
    assert sail.__annotations__ == {"boat": str, "wind": float, "rain": Any, "sailors": people, "return": tuple}
    assert inspect.getdoc(sail) == (
        "Sail.\n\nArgs:\n    boat: name.\n    sailors: number.\n    rain: of today.\n    wind: speed, m/s; and\n"
        "        gusts, too.\n\nRaises:\n    BadInput: never."
    )


@pytest.mark.parametrize("name", sorted(catalogue.names("controllers")))
def test_every_option_of_a_law_is_explained(name):
    part = catalogue.names("controllers")[name]
    for function in catalogue.presets_of(part).values() or [part]:
        assert [option.name for option in options_of("controllers", function) if not option.meaning] == []
