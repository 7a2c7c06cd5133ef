"""The version is stated in pyproject.toml; whatever else says it agrees, or reads it from there."""

import importlib.metadata
import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import undertow
from undertow.cli.main import run

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
VERSION = PROJECT["version"]
CITATION = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
HEADING = re.compile(r"^## (?P<version>\S+) \((?P<date>unreleased|\d{4}-\d{2}-\d{2})\)$", re.M)


def naming(text, *paths):
    """Files of git that have a text in them."""
    found = subprocess.run(["git", "grep", "-lF", "-e", text, "--", *paths], cwd=ROOT, capture_output=True, text=True)
    assert found.returncode in (0, 1), found.stderr
    return set(found.stdout.split())


def test_the_package_and_the_command_say_it(capsys):
    assert importlib.metadata.version("undertow") == undertow.__version__ == VERSION
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"undertow {VERSION}\n"


def test_the_newest_heading_of_the_changelog_and_the_citation_are_of_this_version_and_date():
    newest = HEADING.search((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))
    assert newest and newest["version"] == CITATION["version"] == VERSION
    assert str(CITATION.get("date-released", "unreleased")) == newest["date"]


def test_no_page_and_no_module_repeats_it():
    assert naming(VERSION, "undertow", "docs", "soak", "README.md", "CONTRIBUTING.md", ".github", "paper.md") == set()


@pytest.mark.parametrize("place", sorted(PROJECT["urls"].values()))
def test_no_other_file_repeats_where_the_project_is(place):
    assert naming(place) == {"pyproject.toml"}


def test_no_other_file_repeats_the_address_of_its_authors():
    (authors,) = PROJECT["authors"]
    assert naming(authors["email"]) == {"pyproject.toml"}
