"""Links of pages to files of the repository that the site shows as pages of its own."""

import os.path
import re
from typing import Any

from sphinx.application import Sphinx

# File of the repository -> page of the site that includes it.
_PAGES = {
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "simdjit/README.md": "explanation/simdjit.md",
}
_LINK = re.compile(rf"\]\((?:\.\./)+({'|'.join(map(re.escape, _PAGES))})")


def _rewrite(app: Sphinx, page: str, source: list[str]) -> None:
    here = os.path.dirname(page)
    source[0] = _LINK.sub(lambda link: f"]({os.path.relpath(_PAGES[link[1]], here or '.')}", source[0])


def setup(app: Sphinx) -> dict[str, Any]:
    """Rewrite these links while pages are read; in the repository they lead to the files."""
    app.connect("source-read", _rewrite)
    return {"parallel_read_safe": True}
