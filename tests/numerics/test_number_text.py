"""What is a number in a file, and what only Python takes for one."""

import math

import pytest

from undertow.core.number_text import number_in


@pytest.mark.parametrize(
    ("text", "value"), [("1", 1), ("-2.5e3", -2500), (".5", 0.5), ("3.", 3), ("+1E-2", 0.01), ("inf", math.inf)]
)
def test_numbers(text, value):
    assert number_in(text) == value


def test_what_was_not_measured():
    assert math.isnan(number_in("NaN"))


@pytest.mark.parametrize(
    "text", ["1_000", "\uff11\uff12", "\u0661", "1e999", "-1e400", "0x10", "1,5", "", " 1", "1e", "e5", "--1"]
)
def test_what_is_none(text):
    with pytest.raises(ValueError):
        number_in(text)
