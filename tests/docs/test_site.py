"""The documentation site: every page is in a table of contents, every relative link leads somewhere, and it builds.

The directives in docs/_ext are tested by values that the code has too.
"""

import importlib
import re
from pathlib import Path

import pytest

from undertow.core import catalogue

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if "_build" not in path.parts and "gallery" not in path.parts)
READ = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES]

_TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```", re.M | re.S)
_CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.M | re.S)
_LINK = re.compile(r"\]\(([^)\s]+)\)")


def listed(page):
    """Pages that the tables of contents of a page name."""
    for contents in _TOCTREE.findall(page.read_text("utf-8")):
        entries = [line.strip() for line in contents.splitlines() if line.strip() and not line.startswith(":")]
        for entry in entries:
            yield from page.parent.glob(f"{entry}.md")


def test_every_page_is_in_a_table_of_contents():
    assert set(PAGES) - {DOCS / "index.md"} == {found for page in PAGES for found in listed(page)} - {DOCS / "index.md"}


@pytest.mark.parametrize("page", READ, ids=lambda page: str(page.relative_to(ROOT)))
def test_relative_links_lead_to_files(page):
    text = _CODE.sub("", page.read_text("utf-8"))
    targets = [link.partition("#")[0] for link in _LINK.findall(text) if "://" not in link]
    made = DOCS / "gallery"  # by the build
    broken = [to for to in targets if to and not (page.parent / to).exists() and made not in (page.parent / to).parents]
    assert not broken


def test_every_kind_of_part_has_a_page():
    assert {path.stem for path in (DOCS / "reference" / "parts").glob("*.md")} - {"index"} == set(catalogue.KINDS)


def test_every_hypothesis_is_explained():
    folder = ROOT / "undertow" / "analysis" / "certificate"
    names = re.findall(r'Hypothesis\("(\w+)"', (folder / "hypotheses.py").read_text("utf-8"))
    page = (DOCS / "explanation" / "certificate.md").read_text("utf-8")
    assert len(names) >= 10
    assert [name for name in names if f"| `{name}` |" not in page] == []


def extension(name, monkeypatch):
    """A module of docs/_ext; the site's own packages may be missing."""
    pytest.importorskip("docutils")
    monkeypatch.syspath_prepend(DOCS / "_ext")
    return importlib.import_module(name)
