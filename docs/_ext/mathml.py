"""Mathematics as MathML, which browsers typeset themselves: the pages load no script and no font.

`\\tag{23}` in a formula that stands on its own line is its number, at the right.
"""

import html
import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

_TAG = re.compile(r"\\tag\{([^}]*)\}")


def mathml(tex: str, block: bool = False) -> str:
    """A formula as a MathML element.

    Raises:
        ValueError: the formula has a command that is not known, or a brace without its partner.
    """
    try:
        return tex2mathml(tex, as_block=block)
    except MathError as error:
        raise ValueError(f"{error} in the formula {tex}") from None


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
