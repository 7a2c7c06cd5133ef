"""Formulas as MathML, which browsers typeset themselves: from TeX, and from symbols in plain text."""

import html
import re
import xml.etree.ElementTree as ET

from latex2mathml.converter import convert_to_element

from undertow.report.page import Html, marked, text

# Symbols of the paper as plain text spells them -> TeX. Longer spellings come first.
SYMBOLS = {
    "theta_dot": r"\dot\theta",
    "theta_max": r"\theta_\mathrm{max}",
    "gamma_eps": r"\gamma_\varepsilon",
    "omega_bar": r"\bar\omega",
    "alpha_F": r"\alpha_F",
    "x_hat_dot": r"\dot{\hat x}",
    "x_d_ddot": r"\ddot x_d",
    "x_ddot": r"\ddot x",
    "x_dot": r"\dot x",
    "x_hat": r"\hat x",
    "x_d": "x_d",
    "d_hat": r"\hat d",
    "d_dot": r"\dot d",
    "w_bar": r"\bar w",
    "nu_dot": r"\dot\nu",
    "Om_dot": r"\dot\Omega",
    "J_dot": r"\dot J",
    "eps": r"\varepsilon",
    "E^T P B": "E^T P B",
    "E^T Q E": "E^T Q E",
}
_INVERSES = {"G#": r"G^{\#}", "G+": "G^+"}
_SYMBOL = rf"((?<![\w`^./|-])(?:{'|'.join(map(re.escape, SYMBOLS))})(?![\w`^.]*\w)|(?<!\w)G(?:#|\+)(?!\w))"

# What `\href`, `\style` and `\class` of a description would set in a page.
_ACTIVE_ATTRIBUTES = ("href", "style", "class", "id")

# Elements that browsers show as an error with another number of parts.
_PARTS = {"mfrac": 2, "msub": 2, "msup": 2, "munder": 2, "mover": 2, "msubsup": 3, "munderover": 3}


def mathml(tex: str) -> Html:
    r"""A formula.

    Raises:
        ValueError: it has a command that is not known, or lacks something, such as the index of `x_`.
    """
    try:
        formula = convert_to_element(tex)
    except Exception as error:  # the library's errors have no class in common
        raise ValueError(f"the formula {tex} is not complete: {type(error).__name__}") from None
    formula.attrib.clear()  # what a page need not say
    for element in formula.iter():
        element.text = html.unescape(element.text or "")  # the library writes characters as entities
        for name in _ACTIVE_ATTRIBUTES:
            element.attrib.pop(name, None)
        if element.tag == "mi" and element.text.startswith("\\"):
            raise ValueError(f"the formula {tex} has an unknown command: {element.text}")
        if len(element) != _PARTS.get(element.tag, len(element)):
            raise ValueError(f"the formula {tex} is not complete")
        if element.tag == "mover" and element[1].tag == "mo":
            element.set("accent", "true")  # as close to its letter as an accent
    return Html(ET.tostring(formula, "unicode", short_empty_elements=False))


def with_symbols(content: str) -> Html:
    """Plain text with the formulas between dollar signs, and the symbols of the paper, as MathML."""
    with_letters = lambda plain: marked(_SYMBOL, plain, lambda word: mathml((SYMBOLS | _INVERSES)[word]))
    return marked(r"\$(?=\S)([^$]+)(?<=\S)\$", content, _formula, with_letters)


def _formula(tex: str) -> Html:
    """A formula; as it was written where it is none, such as in a description that mentions two prices."""
    try:
        return mathml(tex)
    except ValueError:
        return text(f"${tex}$")
