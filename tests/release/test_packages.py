"""What `python -m build` makes: a wheel with every file of the two packages and nothing else, an sdist that makes the same wheel."""

import configparser
import email
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = SETTINGS["project"]
NAME = f"{PROJECT['name']}-{PROJECT['version']}"


def in_git(*folders):
    """Files that git knows, by their paths from the root."""
    listing = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", *folders],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    return {path for path in listing.stdout.split("\0") if path}


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """The wheel, which is made from the sdist, and the sdist; nothing is downloaded."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, ROOT]
    made = subprocess.run(command, capture_output=True, text=True)
    assert made.returncode == 0, made.stdout + made.stderr
    wheel, sdist = folder / f"{NAME}-py3-none-any.whl", folder / f"{NAME}.tar.gz"
    assert set(folder.iterdir()) == {wheel, sdist}
    return wheel, sdist


def contents(wheel):
    """Bytes of each file of a wheel by its name."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def bounds(lines):
    """Versions that each package may have, by the name that package indexes use."""
    requirements = [Requirement(line) for line in lines]
    return {canonicalize_name(requirement.name): requirement.specifier for requirement in requirements}


def test_the_wheel_has_every_file_of_the_packages_and_nothing_else(packages):
    files = contents(packages[0])
    expected = {path.removeprefix("simdjit/") for path in in_git("undertow", "simdjit/simdjit")}
    assert {name for name in files if not name.startswith(f"{NAME}.dist-info/")} == expected
    for name in (
        "undertow/scenario/templates/scenario.yaml",
        "undertow/report/page.css",
        "undertow/report/replay/replay.js",
    ):
        assert files[name] == (ROOT / name).read_bytes()
    assert files["simdjit/py.typed"] == (ROOT / "simdjit" / "simdjit" / "py.typed").read_bytes()


def test_the_wheel_says_what_the_project_says(packages):
    files = contents(packages[0])
    metadata = email.message_from_bytes(files[f"{NAME}.dist-info/METADATA"])
    assert (metadata["Name"], metadata["Version"]) == (PROJECT["name"], PROJECT["version"])
    assert (metadata["License-Expression"], metadata["Requires-Python"]) == ("MIT", PROJECT["requires-python"])
    urls = dict(line.split(", ", 1) for line in metadata.get_all("Project-URL"))
    assert urls == PROJECT["urls"]
    always = [line for line in metadata.get_all("Requires-Dist") if "extra ==" not in line]
    assert bounds(always) == bounds(PROJECT["dependencies"])
    commands = configparser.ConfigParser()
    commands.read_string(files[f"{NAME}.dist-info/entry_points.txt"].decode())
    assert dict(commands["console_scripts"]) == PROJECT["scripts"]
    assert files[f"{NAME}.dist-info/licenses/LICENSE"] == (ROOT / "LICENSE").read_bytes()


def test_the_sdist_has_what_it_names_and_nothing_else(packages):
    with tarfile.open(packages[1]) as archive:
        files = {name.removeprefix(f"{NAME}/") for name in archive.getnames()}
    named = in_git(*SETTINGS["tool"]["hatch"]["build"]["targets"]["sdist"]["only-include"])
    added = {"pyproject.toml", "README.md", "LICENSE", ".gitignore", "PKG-INFO"}  # by hatchling
    assert files == named | added
