"""A figure that stands in two documents is the same in both."""

import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
README, SIMD, LIMITS, CLAIMS = (
    (ROOT / name).read_text("utf-8")
    for name in (
        "README.md",
        "docs/explanation/simd.md",
        "docs/explanation/known-limits.md",
        "docs/explanation/paper-claims.md",
    )
)


def plain(text):
    """With line breaks and the spaces inside numbers taken out."""
    return re.sub(r"(?<=\d) (?=\d{3}\b)", "", " ".join(text.split()))


def test_speed():
    """Nanoseconds per step and the factor over NumPy of README are those of the table in docs/explanation/simd.md."""
    said = re.search(r"about (\d+) ns per step .*?, (\d+) times faster than plain NumPy", plain(README))
    assert said is not None
    ns, times = said.groups()
    row = next(line for line in plain_rows(SIMD) if line[0] == "W1, many runs, all threads")
    assert abs(float(row[3].removesuffix(" ns")) - float(ns)) <= 0.5 and times == row[4]


def plain_rows(text):
    return [[plain(cell) for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]


def test_times_of_divergence():
    """Seconds after which the paper's laws end, on the page of claims, are those of the page of limits."""
    ends = re.findall(r"(?:after|lasts|with none) (\d+(?:\.\d+)?) s\b", plain(CLAIMS))
    assert {"60", "1829", "135", "547", "122"} <= set(ends)
    for end in ("60", "1829", "135", "547", "122"):
        assert re.search(rf"\b{end}(?:,| s| and)", plain(LIMITS)), end
