"""The paper is cited with authors, title, journal, year and DOI wherever undertow presents itself."""

from pathlib import Path

import pytest
from ruamel.yaml import YAML

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
DOI = "10.1007/s11071-017-3590-2"
TITLE = (
    "Robust control for MIMO hybrid dynamical system of underwater vehicles by composite adaptive fuzzy estimation of "
    "uncertainties"
)

# Required fields of the Citation File Format 1.2.0, of the file and of an article.
REQUIRED = {"cff-version", "message", "title", "authors"}
ARTICLE = {"type": "article", "title": TITLE, "journal": "Nonlinear Dynamics", "year": 2017, "doi": DOI}


def test_citation_file():
    found = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert found.keys() >= REQUIRED and found["cff-version"] == "1.2.0" and found["type"] == "software"
    (paper,) = found["references"]
    assert paper | ARTICLE == paper
    assert [author["family-names"] for author in paper["authors"]] == ["Ghavidel", "Kalat"]


@pytest.mark.parametrize("page", ["README.md", "docs/reference/paper-map.md", "undertow/paper/pages/background.py"])
def test_pages(page):
    text = "".join((ROOT / page).read_text(encoding="utf-8").replace('"', "").replace(">", "").split())
    for words in ("Ghavidel and Kalat", TITLE, "Nonlinear Dynamics", "2017", DOI):
        assert words.replace(" ", "") in text
