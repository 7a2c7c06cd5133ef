"""Formulas in pages are MathML: the element tree is that of the formula, and pages contain no ASCII formulas."""

import html
import re
from xml.etree import ElementTree

import pytest

from undertow.report.formats import prose
from undertow.report.mathml import SYMBOLS, mathml, with_symbols


def flat(element):
    """Nested tuples of tags and texts."""
    return (element.tag, *map(flat, element)) if len(element) else (element.tag, element.text)


def tree(tex):
    (row,) = ElementTree.fromstring(mathml(tex))
    return flat(row)[1:]


def test_the_adaptation_law():
    r"""Eq. (44): accents, indices, powers and Greek letters where they belong."""
    assert tree(r"\dot\theta = -\gamma (E^T P B + \gamma_\varepsilon \varepsilon) \xi") == (
        ("mover", ("mi", "\u03b8"), ("mo", "\u02d9")),
        ("mo", "="),
        ("mo", "\u2212"),
        ("mi", "\u03b3"),
        ("mo", "("),
        ("msup", ("mi", "E"), ("mi", "T")),
        ("mi", "P"),
        ("mi", "B"),
        ("mo", "+"),
        ("msub", ("mi", "\u03b3"), ("mi", "\u03b5")),
        ("mi", "\u03b5"),
        ("mo", ")"),
        ("mi", "\u03be"),
    )


@pytest.mark.parametrize(
    "tex, expected",
    [
        (r"\frac{R k_f}{k_t}", ("mfrac", ("mrow", ("mi", "R"), ("msub", ("mi", "k"), ("mi", "f"))))),
        (r"x_d^2", ("msubsup", ("mi", "x"), ("mi", "d"), ("mn", "2"))),
        (r"\dot{\hat x}", ("mover", ("mrow", ("mover", ("mi", "x"), ("mo", "^"))), ("mo", "\u02d9"))),
        (r"G^{\#}", ("msup", ("mi", "G"), ("mrow", ("mi", "#")))),
        (r"\sqrt{\beta}", ("msqrt", ("mrow", ("mi", "\u03b2")))),
        (r"\text{a<b}", ("mtext", "a<b")),
    ],
)
def test_elements(tex, expected):
    (found,) = tree(tex)
    assert found[: len(expected)] == expected


@pytest.mark.parametrize("tex", [r"\unknown", "x_", r"\frac{a}", r"\hat", "", 400 * "{"])
def test_what_is_no_formula_is_an_error(tex):
    with pytest.raises(ValueError, match=r"unknown|not complete"):
        mathml(tex)


def test_accents_stand_close_to_their_letters():
    for tex in (r"\dot x", r"\ddot x", r"\bar x", r"\hat x", r"\tilde x"):
        assert '<mover accent="true">' in mathml(tex)


@pytest.mark.parametrize("tex", [r"\href{javascript:alert()}{x}", r"\style{position: fixed}{x}", r"\class{wide}{x}"])
def test_a_formula_brings_neither_links_nor_styles_into_a_page(tex):
    assert not re.search("href|style|class|<a", mathml(tex))
    assert "<mi>x</mi>" in mathml(tex)


def test_symbols_in_plain_text():
    assert with_symbols("rms of d_hat - d") == f"rms of {mathml(SYMBOLS['d_hat'])} - d"
    assert prose("x_d_ddot and G#") == f"{mathml(SYMBOLS['x_d_ddot'])} and {mathml('G^{#}')}"
    assert prose(r"gain $\gamma$ < 1") == "gain " + mathml(r"\gamma") + " &lt; 1"


@pytest.mark.parametrize("words", [r"gain $\unknown$ of x", "5 $ or 6 $", "$" + 400 * "{" + "$"])
def test_dollar_signs_of_a_description_that_is_no_formula(words):
    assert html.unescape(re.sub("<[^>]*>", "", prose(words))).count("$") == words.count("$")


def test_names_in_code_and_units_stay():
    assert prose("`x_dot` in m/s^2") == "<code>x_dot</code> in m/s<sup>2</sup>"
    assert "<math" not in prose("steps.eps and max_eps")


@pytest.mark.parametrize("tex", [*SYMBOLS.values(), r"G^{\#}", "G^+"])
def test_every_symbol_is_well_formed(tex):
    assert ElementTree.fromstring(mathml(tex)).tag == "math"
