"""Numbers, units and verdicts by examples: every page writes them alike."""

import pytest

from undertow.core.number_text import plain
from undertow.report.formats import meets_default_criterion, number, outcome, prose, quantity

MINUS, TIMES = "\u2212", "&thinsp;&times;&thinsp;10"


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"),
        (5, "5"),
        (-2.0, f"{MINUS}2"),
        (48.97, "49.0"),
        (0.0097, "0.00970"),
        (1234.4, "1234"),
        (999.96, "1000"),
        (-1.593e-4, f"{MINUS}1.59 \u00d7 10\u207b\u2074"),
        (236988.0, "2.37 \u00d7 10\u2075"),
    ],
)
def test_numbers_in_figures_and_on_pages_have_the_same_digits(value, shown):
    assert plain(value) == shown
    if "\u00d7" not in shown:
        assert number(value) == shown


def test_angles_are_degrees_and_units_stand_with_their_number():
    assert quantity(0.05, "rad") == '2.86&nbsp;<span class="unit">deg</span>'
    assert quantity(1.5, "m/s^2") == '1.50&nbsp;<span class="unit">m/s<sup>2</sup></span>'
    assert quantity(0.25, "") == "0.250" and quantity(None, "m") == "&ndash;"


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("rms 1.6e-4 m", f"rms 1.6{TIMES}<sup>{MINUS}4</sup> m"),
        ("2.4e+05 V/s", f"2.4{TIMES}<sup>5</sup> V/s"),
        ("0.00016 and 0.0016", f"1.6{TIMES}<sup>{MINUS}4</sup> and 0.0016"),
        ("0.0002 m", f"2{TIMES}<sup>{MINUS}4</sup> m"),
        ("0.0000512", f"5.12{TIMES}<sup>{MINUS}5</sup>"),
        ("from -1 to 1, (-2)", f"from {MINUS}1 to 1, ({MINUS}2)"),
        ("-1.5 +- 4.2j", f"{MINUS}1.5 &plusmn; 4.2j"),
        ("Eqs. (1)-(6), C1-C4, 2026-11-23, a-1", "Eqs. (1)-(6), C1-C4, 2026-11-23, a-1"),
        ("`--seed -1e-4`", "<code>--seed -1e-4</code>"),
        ("1e5f3, x1e-4, 3.0001", "1e5f3, x1e-4, 3.0001"),
        ("N s^-2, V_dot <= 0", f"N s<sup>{MINUS}2</sup>, V_dot &le; 0"),
    ],
)
def test_numbers_in_sentences_are_typeset(words, shown):
    assert prose(words) == shown


def test_completing_is_not_success():
    assert meets_default_criterion({"position_rms": 0.049, "attitude_rms": 0.049}) is True
    assert meets_default_criterion({"position_rms": 0.049, "attitude_rms": 0.051}) is False
    assert meets_default_criterion(None) is None
    colours = [outcome("x", *one) for one in ((True, True), (True, False), (True, None), (False, None), (False, True))]
    assert [one.split('"')[1] for one in colours] == [
        "chip holds", "chip partly", "chip open", "chip fails", "chip fails",
    ]  # fmt: skip
