"""Every mistake in a CSV file of samples is one line that names the file and the row."""

import pytest
from good_scenario import SCENARIO
from messages import named

HEADER = "t,d1,d2,d3,d4,d5,d6\n"
ROW = ",0,0,0,0,0,0\n"

MISTAKES = {
    "empty": ("", "have a header and at least two rows, but is d.csv, which is empty"),
    "header only": (HEADER, "have at least two rows of samples, but is d.csv with 0"),
    "one row": (f"{HEADER}0{ROW}", "have at least two rows of samples, but is d.csv with 1"),
    "no header": (f"0{ROW}1{ROW}", "have the columns t, d1, d2, ..., but is d.csv with columns 0, 0, 0, 0, 0, 0, 0"),
    "times that go back": (f"{HEADER}0{ROW}2{ROW}1{ROW}", "have increasing times, but is d.csv, line 4: 1 after 2"),
    "times that repeat": (f"{HEADER}0{ROW}1{ROW}1{ROW}", "have increasing times, but is d.csv, line 4: 1 after 1"),
    "cell that is no number": (
        f"{HEADER}0{ROW}1,0,0,x,0,0,0\n",
        "hold numbers only, but is d.csv, line 3: 1, 0, 0, x, 0, 0, 0",
    ),
    "empty cell": (f"{HEADER}0{ROW}1,0,0,,0,0,0\n", "hold numbers only, but is d.csv, line 3: 1, 0, 0, , 0, 0, 0"),
    "NaN": (
        f"{HEADER}0{ROW}1,0,0,nan,0,0,0\n",
        "hold finite numbers only, but is d.csv, line 3: 1, 0, 0, nan, 0, 0, 0",
    ),
    "short row": (f"{HEADER}0{ROW}1,0\n", "have 7 columns in every row, but is d.csv, line 3 with 2"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_is_one_exact_line(refused, tmp_path, mistake):
    text, said = MISTAKES[mistake]
    (tmp_path / "d.csv").write_text(text)
    (tmp_path / "s.yaml").write_text(SCENARIO.replace("kind: u1", "kind: table, file: d.csv"))
    assert refused("simulate", "s.yaml") == f"`disturbance.file` must {said} (s.yaml, line 8)"


def test_missing_file(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO.replace("kind: u1", "kind: table, file: d.csv"))
    said = f"`disturbance.file` must be an existing CSV file, but is {tmp_path / 'd.csv'} (s.yaml, line 8)"
    assert named(refused("simulate", "s.yaml")) == named(said)


def test_wrong_number_of_columns(refused, tmp_path):
    (tmp_path / "d.csv").write_text("t,d1\n0,1\n1,2\n")
    (tmp_path / "s.yaml").write_text(SCENARIO.replace("kind: u1", "kind: table, file: d.csv"))
    said = "`disturbance.samples` must have columns t, d1..d6, but is a table of 2 columns (s.yaml, line 8)"
    assert named(refused("simulate", "s.yaml")) == named(said)
