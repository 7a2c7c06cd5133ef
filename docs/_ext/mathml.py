"""Mathematics as MathML, which browsers typeset themselves: the pages load no script and no font.

docutils translates, which Sphinx brings: unlike `latex2mathml`, which the pages of undertow use, it knows `\\arg`, and
sets a minus sign closely before its term.

`\\tag{23}` in a formula that stands on its own line is its number, at the right.
"""

import html
import re
import xml.etree.ElementTree as ET
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import accents, tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

ET.register_namespace("", "http://www.w3.org/1998/Math/MathML")

_TAG = re.compile(r"\\tag\{([^}]*)\}")


def mathml(tex: str, block: bool = False) -> str:
    """A formula as a MathML element.

    Raises:
        ValueError: the formula has a command that is not known, or a brace without its partner.
    """
    try:
        found = tex2mathml(tex, as_block=block)
    except MathError as error:
        raise ValueError(f"{error} in the formula {tex}") from None
    root = ET.fromstring(found.replace("&ApplyFunction;", "\u2061"))
    for element in root.findall(".//{*}munderover"):
        _index_beside_accent(element)
    for sign in root.iterfind(".//{*}mo"):
        if sign.text == "|":  # of an absolute value, not of a division
            sign.attrib |= {"lspace": "0", "rspace": "0"}
    return ET.tostring(root, "unicode", short_empty_elements=False)


def _index_beside_accent(element: ET.Element) -> None:
    r"""The index of `\dot x_i` stands beside the accented letter; docutils puts it below, as that of a sum."""
    base, index, accent = element
    if accent.text not in accents.values():
        return
    space = element.tag.removesuffix("munderover")
    accented = ET.Element(f"{space}mover", accent="true")
    accented.extend([base, accent])
    element.tag = f"{space}msub"
    element[:] = [accented, index]


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_typeset(node, node.astext(), False))
    raise nodes.SkipNode


def _displayed(translator: Any, node: nodes.math_block) -> None:
    tex = node.astext()
    tag = _TAG.search(tex)
    number = f'<span class="number">({html.escape(tag[1])})</span>' if tag else ""
    translator.body.append(f'<div class="formula">{_typeset(node, _TAG.sub("", tex), True)}{number}</div>\n')
    raise nodes.SkipNode


def _typeset(node: nodes.Node, tex: str, block: bool) -> str:
    try:
        return mathml(tex.strip(), block)
    except ValueError as error:
        logging.getLogger(__name__).warning("%s", error, location=node)
        return html.escape(tex)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the way in which HTML pages show formulas."""
    app.add_html_math_renderer("mathml", (_inline, None), (_displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
