"""The Python interface and the contracts from their docstrings.

The directive `exports` lists what `import undertow` offers. Fields of named tuples and parts are described by what the
code says beside them: the comment on their line, or the unit and meaning of a parameter.
"""

import dataclasses
import importlib
import inspect
import re
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import undertow
from undertow.core import catalogue


class Exports(SphinxDirective):
    """The public names of `undertow`; stands in reStructuredText, where the directives of autodoc are."""

    def run(self) -> list[nodes.Node]:
        self.env.note_reread()
        entries = [_entry(name) for name in dir(undertow) if name not in (*catalogue.KINDS, "__version__")]
        return self.parse_text_to_nodes("\n\n".join(entries))


def _entry(name: str) -> str:
    documented = getattr(undertow, name)
    if not inspect.isclass(documented):
        return f".. autofunction:: undertow.{name}"
    return f".. autoclass:: undertow.{name}\n   :members:"


def _describe_field(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Replace what autodoc says of a field without a docstring; |x| in a docstring is an absolute value."""
    lines[:] = [line.replace("|", "\\|") for line in lines]
    if what != "attribute" or (lines and not lines[0].startswith("Alias for field number")):
        return
    where, _, field = name.rpartition(".")
    module, _, owner = where.rpartition(".")
    lines[:] = [field_meaning(getattr(importlib.import_module(module), owner, None), field), ""]


def field_meaning(owner: Any, name: str) -> str:
    """What the code says of a field of a class; empty where it says nothing."""
    for field in dataclasses.fields(owner) if dataclasses.is_dataclass(owner) else ():
        if field.name == name and "unit" in field.metadata:
            meaning, unit = field.metadata["meaning"], field.metadata["unit"]
            return f"{meaning}, {unit}" if unit else meaning
    line = (
        re.search(rf"^    {name}: [^#\n]*# (.*)$", inspect.getsource(owner), re.M) if inspect.isclass(owner) else None
    )
    return line[1] if line else ""


def _shorten(app: Sphinx, tree: nodes.document) -> None:
    """The arrays of JAX by the name that users know."""
    for text in [text for one in tree.findall(addnodes.desc_signature) for text in one.findall(nodes.Text)]:
        if "jaxlib._jax." in text:
            text.parent.replace(text, nodes.Text(text.replace("jaxlib._jax.", "")))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive and what changes the output of autodoc."""
    app.add_directive("exports", Exports)
    app.connect("autodoc-process-docstring", _describe_field)
    app.connect("doctree-read", _shorten)
    return {"parallel_read_safe": True}
