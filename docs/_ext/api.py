"""Directive that lists what `import undertow` offers, and documents every class and function of it."""

import inspect
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import undertow
from undertow.core import catalogue


class Exports(SphinxDirective):
    """The public names of `undertow`; stands in reStructuredText, where the directives of autodoc are."""

    def run(self) -> list[nodes.Node]:
        entries = [_entry(name) for name in dir(undertow) if name not in (*catalogue.KINDS, "__version__")]
        return self.parse_text_to_nodes("\n\n".join(entries))


def _entry(name: str) -> str:
    documented = getattr(undertow, name)
    if not inspect.isclass(documented):
        return f".. autofunction:: undertow.{name}"
    return f".. autoclass:: undertow.{name}\n   :members:"


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("exports", Exports)
    return {"parallel_read_safe": True}
