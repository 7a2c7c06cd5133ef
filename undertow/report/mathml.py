"""Formulas as MathML, which browsers typeset themselves: from a small part of TeX, and from symbols in plain text."""

import html
import re

from undertow.report.page import Html, marked, text

_IDENTIFIERS = {
    **{"alpha": "\u03b1", "gamma": "\u03b3", "delta": "\u03b4", "varepsilon": "\u03b5", "eta": "\u03b7"},
    **{"theta": "\u03b8", "mu": "\u03bc", "nu": "\u03bd", "xi": "\u03be", "sigma": "\u03c3", "tau": "\u03c4"},
    **{"phi": "\u03c6", "omega": "\u03c9", "Delta": "\u0394", "Omega": "\u03a9"},
    **{word: word for word in ("exp", "sin", "cos", "tanh", "sign", "argmin", "sup")},
}
_SIGNS = {
    **{"cdot": "\u22c5", "le": "\u2264", "ge": "\u2265", "infty": "\u221e", "pm": "\u00b1", "times": "\u00d7"},
    "#": "#",
}
_ACCENTS = {"hat": "^", "bar": "\u00af", "tilde": "~", "dot": "\u02d9", "ddot": "\u00a8"}
_TOKEN = re.compile(r"\\(?P<name>[A-Za-z]+|#)|(?P<number>\d+(?:\.\d+)?)|(?P<letter>[A-Za-z])|(?P<sign>[^\s])")

# Symbols of the paper as plain text spells them -> TeX. Longer spellings come first.
SYMBOLS = {
    "theta_dot": r"\dot\theta",
    "theta_max": r"\theta_{max}",
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


def mathml(tex: str) -> Html:
    r"""A formula, from letters, numbers, signs, groups, `^`, `_`, Greek letters, accents and `\frac`.

    Raises:
        ValueError: a command or a brace is not known.
    """
    items, rest = _row(_tokens(tex))
    if rest:
        raise ValueError(f"closing brace without an opening one: {tex}")
    return Html(f"<math>{''.join(items)}</math>")


def with_symbols(content: str) -> Html:
    """Plain text with the formulas between dollar signs, and the symbols of the paper, as MathML."""
    with_letters = lambda plain: marked(_SYMBOL, plain, lambda word: mathml((SYMBOLS | _INVERSES)[word]))
    return marked(r"\$(?=\S)([^$]+)(?<=\S)\$", content, _formula, with_letters)


def _formula(tex: str) -> Html:
    """A formula; as it was written where it is none, such as in a description that mentions two prices."""
    try:
        return mathml(tex)
    except (ValueError, RecursionError):
        return text(f"${tex}$")


def _tokens(tex: str) -> list[tuple[str, str]]:
    return [(str(found.lastgroup), found[found.lastgroup or 0]) for found in _TOKEN.finditer(tex)]


def _row(tokens: list[tuple[str, str]]) -> tuple[list[str], list[tuple[str, str]]]:
    """Elements up to a closing brace or the end, and the tokens after it."""
    items: list[str] = []
    while tokens and tokens[0] != ("sign", "}"):
        (_, sign), after = tokens[0], tokens[1:]
        if sign in "^_" and tokens[0][0] == "sign" and items:
            item, tokens = _item(after)
            base = items.pop()
            upper, lower = sign == "^", base.startswith("<msub>")
            if upper and lower:
                items.append(base.replace("<msub>", "<msubsup>", 1).removesuffix("</msub>") + f"{item}</msubsup>")
            else:
                name = "msup" if upper else "msub"
                items.append(f"<{name}>{base}{item}</{name}>")
        else:
            item, tokens = _item(tokens)
            items.append(item)
    return items, tokens


def _item(tokens: list[tuple[str, str]]) -> tuple[str, list[tuple[str, str]]]:
    """One element, and the tokens after it."""
    if not tokens:
        raise ValueError("formula ends where a symbol is missing")
    (kind, word), rest = tokens[0], tokens[1:]
    if (kind, word) == ("sign", "{"):
        items, rest = _row(rest)
        if not rest:
            raise ValueError("opening brace without a closing one")
        plain = "".join(re.findall(r"<mi>([A-Za-z])</mi>", "".join(items)))
        if len(plain) == len(items) > 1:  # a word, as in an index
            return f"<mi>{plain}</mi>", rest[1:]
        return (items[0] if len(items) == 1 else f"<mrow>{''.join(items)}</mrow>"), rest[1:]
    if kind == "name":
        return _command(word, rest)
    element = {"number": "mn", "letter": "mi"}.get(kind, "mo")
    return f"<{element}>{html.escape(word.replace('-', chr(0x2212)))}</{element}>", rest


def _command(name: str, rest: list[tuple[str, str]]) -> tuple[str, list[tuple[str, str]]]:
    if name in _ACCENTS:
        base, rest = _item(rest)
        return f'<mover accent="true">{base}<mo>{_ACCENTS[name]}</mo></mover>', rest
    if name == "frac":
        above, rest = _item(rest)
        below, rest = _item(rest)
        return f"<mfrac>{above}{below}</mfrac>", rest
    if name in _IDENTIFIERS:
        return f"<mi>{_IDENTIFIERS[name]}</mi>", rest
    if name in _SIGNS:
        return f"<mo>{_SIGNS[name]}</mo>", rest
    raise ValueError(f"unknown command in a formula: \\{name}")
