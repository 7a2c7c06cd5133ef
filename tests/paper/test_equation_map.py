"""Every equation of the paper has a row in docs/reference/paper-map.md, and the file it names carries its tag."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
EQUATIONS = range(1, 62)

_TAG = re.compile(r"Eqs?\.\s+((?:\(\d+\)(?:\s*(?:-|,|and)\s*)?)+)")


def rows():
    for line in (ROOT / "docs" / "reference" / "paper-map.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) == 4 and re.match(r"\(\d+\)", cells[0]):
            yield cells


def numbers(text):
    """Equation numbers in '(1)-(3), (5)'."""
    found = set()
    for first, last in re.findall(r"\((\d+)\)(?:\s*-\s*\((\d+)\))?", text):
        found |= set(range(int(first), int(last or first) + 1))
    return found


def tagged(path):
    text = re.sub(r"\s*\n\s*#?\s*", " ", path.read_text())
    return set().union(*(numbers(tag) for tag in _TAG.findall(text)))


def test_every_equation_has_exactly_one_row():
    counts = [number for cells in rows() for number in numbers(cells[0])]
    assert sorted(counts) == list(EQUATIONS)


def test_rows_are_complete():
    for equation, printed, implemented, file in rows():
        assert printed and implemented, equation
        assert (ROOT / file.strip("`")).is_file(), equation


def test_named_file_carries_the_tag():
    missing = {cells[0]: cells[3] for cells in rows() if not numbers(cells[0]) <= tagged(ROOT / cells[3].strip("`"))}
    assert not missing


def test_no_tag_outside_the_paper():
    for path in sorted((ROOT / "undertow").rglob("*.py")):
        if "hull" in path.name or "body" in path.name:  # they cite the equations of a book as well
            continue
        assert tagged(path) <= set(EQUATIONS), path


def test_the_reader_of_tags_reads():
    assert numbers("(1)-(3), (5)") == {1, 2, 3, 5}
    assert _TAG.findall("see Eqs. (8), (9) and Eq. (44).") == ["(8), (9) and ", "(44)"]
