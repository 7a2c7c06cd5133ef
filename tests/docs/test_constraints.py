"""constraints.txt has the version of everything that undertow with all its extras installs, and of nothing else."""

import importlib.metadata
import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LINES = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
PINS = [Requirement(line) for line in LINES if not line.startswith("#")]

# What other systems and Pythons than that of this test install beside.
ELSEWHERE = {"colorama", "backports-zstd", "importlib-metadata", "lazy-importer", "zipp"}


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def needed():
    """Names of everything that the extras install here, by what is installed."""
    extras = [line for several in PROJECT["optional-dependencies"].values() for line in several]
    waiting = [Requirement(line) for line in (*PROJECT["dependencies"], *extras)]
    found, seen = set(), set()
    while waiting:
        one = waiting.pop()
        key = plain(one.name), frozenset(one.extras)
        if key in seen or key[0] == "undertow":
            continue
        seen.add(key)
        found.add(key[0])
        for line in importlib.metadata.requires(one.name) or ():
            further = Requirement(line)
            if any(further.marker is None or further.marker.evaluate({"extra": extra}) for extra in (*one.extras, "")):
                waiting.append(further)
    return found


def test_everything_that_is_installed_is_pinned():
    pinned, used = {plain(one.name) for one in PINS}, needed()
    assert not used - pinned and len(used) > 100
    assert pinned - used <= ELSEWHERE


def test_each_is_pinned_to_one_version_on_each_python():
    names = [plain(one.name) for one in PINS]
    assert names == sorted(names)
    for one in PINS:
        assert re.fullmatch(r"==[0-9a-z.]+", str(one.specifier)) and not one.url
        markers = sorted(str(other.marker) for other in PINS if plain(other.name) == plain(one.name))
        assert markers in (["None"], ['python_version < "3.12"', 'python_version >= "3.12"'])
