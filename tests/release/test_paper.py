"""The paper about the software has the sections that JOSS requires, its length, and a reference for every citation."""

import re
from pathlib import Path

import pytest
from ruamel.yaml import YAML

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
_, HEAD, TEXT = (ROOT / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
REFERENCES = (ROOT / "paper.bib").read_text(encoding="utf-8")

# In the order of https://joss.readthedocs.io/en/latest/paper.html; the length is in words.
REQUIRED = [
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "Research impact statement",
    "AI usage disclosure",
    "Acknowledgements",
    "References",
]
SHORTEST, LONGEST = 750, 1750


def test_sections_and_length():
    headings = re.findall(r"^# (.+)$", TEXT, re.M)
    assert [heading for heading in headings if heading in REQUIRED] == REQUIRED
    assert SHORTEST <= len(TEXT.split()) <= LONGEST


def test_metadata():
    head = YAML(typ="safe").load(HEAD)
    assert head.keys() >= {"title", "tags", "authors", "affiliations", "date", "bibliography"}
    known = {str(place["index"]) for place in head["affiliations"]}
    assert {str(author["affiliation"]) for author in head["authors"]} <= known
    assert (ROOT / head["bibliography"]).is_file()


def test_every_citation_has_a_reference_and_every_reference_is_cited():
    keys = re.findall(r"^@\w+\{(\w+),$", REFERENCES, re.M)
    assert len(set(keys)) == len(keys)
    assert set(re.findall(r"@(\w+)", TEXT)) == set(keys)


def test_a_reference_can_be_found():
    """By its DOI or address; for others by publisher or conference."""
    for entry in re.split(r"\n(?=@)", REFERENCES):
        fields = set(re.findall(r"^  (\w+) +=", entry, re.M))
        assert fields >= {"author", "title"}, entry
        assert fields & {"doi", "url", "publisher", "booktitle"}, entry
        assert re.fullmatch(r"10\.\d{4,}/\S+", re.findall(r"doi += \{(.+)\}", (entry + "\n  doi = {10.1000/none}"))[0])
