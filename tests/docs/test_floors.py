"""The lower bounds of pyproject.toml are the versions of floors.txt, with which `.ci/run` tests; simdjit has the same."""

import re
import tomllib
from pathlib import Path

import pytest

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
PROJECT, SIMDJIT = (
    tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for folder in (ROOT, ROOT / "simdjit")
)


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def numbers(version):
    """Numbers of a version without zeros at its end, and without `.post`."""
    found = [int(part) for part in version.split(".post")[0].split(".")]
    while found and not found[-1]:
        found.pop()
    return found


def pins(name):
    lines = [line for line in (ROOT / name).read_text(encoding="utf-8").splitlines() if "==" in line]
    return {plain(line.split("==")[0]): line.split("==")[1].split(";")[0] for line in lines}


@pytest.mark.parametrize("dependency", PROJECT["dependencies"])
def test_floor(dependency):
    name, lowest = dependency.split(">=")
    assert numbers(pins("floors.txt")[plain(name)]) == numbers(lowest)
    assert numbers(pins("constraints.txt")[plain(name)]) >= numbers(lowest)


def test_the_compiler_has_the_same_bounds_and_licence():
    """Both are in one wheel here, and simdjit alone in one of its own."""
    assert set(SIMDJIT["dependencies"]) < set(PROJECT["dependencies"])
    assert SIMDJIT["requires-python"] == PROJECT["requires-python"]
    assert (ROOT / "simdjit" / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()
