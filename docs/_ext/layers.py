"""Directive that shows the folders as layers: from the import contract in pyproject.toml and their docstrings."""

import ast
import html
import re
import tomllib
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]


def layers() -> list[list[str]]:
    """Folders and modules from the top down; those of one layer do not import each other."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (found,) = [contract["layers"] for contract in contracts if contract.get("containers") == ["undertow"]]
    return [[name.strip() for name in layer.split("|")] for layer in found]


def purpose(name: str) -> str:
    """What a folder or module is for: the first sentence of its docstring."""
    folder = ROOT / "undertow" / name
    path = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    text = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split()).split(". ")[0].rstrip(".") + "."


class Layers(SphinxDirective):
    """The layers as rows of boxes."""

    def run(self) -> list[nodes.Node]:
        rows = "".join(f'<div class="layer">{"".join(map(_box, layer))}</div>' for layer in layers())
        self.env.note_reread()
        return [nodes.raw("", f'<div class="layers">{rows}</div>', format="html")]


def _box(name: str) -> str:
    said = re.sub(r"`(.*?)`", r"<code>\1</code>", html.escape(purpose(name)))
    return f"<div><b>{name}</b><span>{said}</span></div>"


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("layers", Layers)
    return {"parallel_read_safe": True}
