"""Tables of a comparison in three styles, and its sentences."""

import csv
import io
import re

import numpy as np
import pytest
import xarray as xr

from undertow.core.metric import Metric
from undertow.report.answers.comparison_answer import answer_of_comparison
from undertow.report.run_tables import metrics_rows
from undertow.studies.comparison.findings import Median, find
from undertow.studies.comparison.sentences import digits, sentences
from undertow.studies.comparison.step_time import StepTime
from undertow.studies.comparison.tables import even_digits, median, medians, table

TRIALS = 10


@pytest.fixture
def findings():
    """Ten trials of three: `b_1` has smaller errors than `a` in all of them; `c` failed in two, at 3 s and 5 s."""
    numbers = np.arange(TRIALS)
    status = np.zeros((3, TRIALS), dtype=np.int8)
    status[2, :2] = 1
    error = np.stack([1 + 0.01 * numbers, 0.5 + 0.02 * numbers, 1 + 0.01 * numbers])
    angle = np.radians(np.stack([numbers + 1.0] * 3))
    ended = np.full((3, TRIALS), 8.0)
    ended[2, :2] = 3.0, 5.0
    along = ("controller", "sample")
    return find(
        xr.Dataset(
            {
                "position_rms": (along, error, {"units": "m"}),
                "attitude_rms": (along, angle, {"units": "rad"}),
                "input_variation": (along, 1e-5 * error, {"units": "m/s^2/s"}),
                "saturated_fraction": (along, 0 * error, {"units": "1"}),
                "status": (along, status),
                "ended": (along, ended),
                "success": (along, np.where(status == 0, 1, -1)),
            },
            {"controller": ["a", "b_1", "c"]},
        ),
        "controller",
        ["position_rms", "attitude_rms", "input_variation", "saturated_fraction"],
        dict.fromkeys(["a", "b_1", "c"], "by hand"),
        {},
    )


def test_medians(findings):
    """Of 10 values, the 2nd and 9th enclose the median in at least 95 %: P(B(10, 1/2) <= 1) = 1.07 %."""
    rows = {row[0]: row[1:] for row in medians(findings).rows}
    assert rows["completed trials"] == ("10 of 10", "10 of 10", "8 of 10")
    assert rows["within the criterion of success"] == ("10 of 10", "10 of 10", "8 of 8")
    assert rows["position error, rms per axis (m)"][:2] == ("1.04 [1.01, 1.08]", "0.59 [0.52, 0.66]*")
    assert rows["attitude error, rms per axis (deg)"][0] == "5.5 [2, 9]"
    assert rows["time at the input limits"] == ("0 [0, 0]",) * 3


def test_computing_time_is_the_last_row(findings):
    """In microseconds; a step by XLA is marked, a law without a time has a dash."""
    times = {"a": StepTime(1.5e-6, "simd"), "b_1": StepTime(4.893e-4, "xla")}
    assert medians(findings, times).rows[-1] == ("computing time per step (\u00b5s)", "1.5", "489 (XLA)", "-")
    assert medians(findings).rows == medians(findings, times).rows[:-1]


def test_what_never_happens_is_never():
    """In the table of a run too; other infinite numbers are `inf`."""
    assert median(Median(12.1, 5.55, np.inf, 20), "s") == "12.1 [5.55, never]"
    assert median(Median(np.inf, 5.55, np.inf, 20), "m") == "inf [5.55, inf]"
    known = {"settling_time": Metric("s", "when it settles"), "position_max": Metric("m", "how far")}
    rows = metrics_rows(None, {"settling_time": None, "position_max": np.inf}, None, known).rows
    assert [row[2] for row in rows] == ["never", "inf"], "null is infinity in a result file"


def test_sentences(findings):
    said = sentences(findings)
    assert said[0] == "c did not complete 2 of 10 trials (diverged 2, median time 4 s)."
    assert said[1].startswith("c completed 0 trials that a did not, and a 2 that c did not; this difference is not")
    assert "b_1 against a (10 pairs): smaller position error rms per axis (-43.5 %, in 10 of 10)" in said[3]
    assert said[3].endswith("no difference is established in attitude error rms per axis, time at the input limits.")
    assert said[4] == "c against a (8 pairs): all differences are zero."
    assert "c against b_1 (8 pairs): larger position error rms per axis" in said[5]


def test_too_few_pairs_for_the_correction(findings):
    """With four tests, 4 x 2^(1 - n) is below 5 % from n = 8 on: 3.1 %."""
    assert sum(bool(one.smaller or one.larger) for one in findings.differences) == 4
    few = findings._replace(differences=tuple(one._replace(pairs=7) for one in findings.differences))
    assert "b_1 against a (7 pairs): too few to establish a difference; at least 8 pairs are needed." in sentences(few)


def test_latex(findings):
    text = table(findings, "latex")
    assert text.startswith("% Needs \\usepackage{booktabs,tabularx}.")
    assert "\\begin{tabularx}{\\linewidth}{Xrrr}\n\\toprule\nmetric & a & b\\_1 & c \\\\" in text
    assert "\\caption{Median over completed trials [95 \\% interval of the median]; metrics of the steady" in text
    assert "\\label{tab:medians}" in text and "\\label{tab:differences}" in text
    assert "position error, rms per axis (m) & 1.04 [1.01, 1.08] & 0.590 [0.520, 0.660]$^{*}$ & " in text
    assert "input variation (m/s$^{2}$/s) & $1.04 \\times 10^{-5}$ [" in text
    assert "b\\_1 $-$ a & position error, rms per axis (m) & $-$0.455 [" in text and "$-$43.5 \\%" in text
    shares = re.findall(r"([\d.]+) \\%", text)
    assert all(len(share.replace(".", "").lstrip("0")) == 3 for share in shares if share not in ("95", "0"))
    for line in text.splitlines():
        if "&" in line:
            assert line.count(" & ") in (3, 6) and line.endswith(" \\\\")
    assert text.count("\\begin{tabularx}") == text.count("\\end{tabularx}") == text.count("\\bottomrule") == 2
    assert text.count("\\begin{table}\n") == text.count("\\end{table}\n") == 2


def test_numbers_of_a_column_have_equal_digits():
    values = (0.59, 1.0, 12.0, 123.4, 0.0012, 0.0, 1234.5, 1.2e-5)
    assert [even_digits(value) for value in values] == [
        "0.590",
        "1.00",
        "12.0",
        "123",
        "0.00120",
        "0",
        "1234",
        "1.20e-05",
    ]


def test_markdown(findings):
    lines = table(findings, "markdown").splitlines()
    assert lines[:3] == [
        "| metric | a | b_1 | c |",
        "|---|---|---|---|",
        "| completed trials | 10 of 10 | 10 of 10 | 8 of 10 |",
    ]
    assert {line.count("|") for line in lines if line.startswith("|")} == {5, 8}


def test_csv(findings):
    rows = list(csv.DictReader(io.StringIO(table(findings, "csv"))))
    assert len(rows) == 3 * 4
    assert rows[0]["metric"] == "position_rms" and (rows[0]["candidate"], rows[0]["baseline"]) == ("b_1", "a")
    assert float(rows[0]["candidate_median"]) - float(rows[0]["baseline_median"]) == pytest.approx(-0.455)
    assert float(rows[0]["median"]) == pytest.approx(-0.455) and rows[0]["established"] == "True"
    assert rows[1]["unit"] == "rad"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (12.345, "12.3"),
        (2026.1, "2026"),
        (-1.234e-5, "-1.23e-05"),
        (1.5e6, "1.50e+06"),
        (float("inf"), "inf"),
    ],
)
def test_digits(value, text):
    assert digits(value) == text


def test_the_answer_ranks_and_says_what_is_established(findings):
    """Who completed most comes first, then the smallest error; `c` is behind although its error is that of `a`."""
    good, verdict, lines = answer_of_comparison(findings, "controller")
    assert good is False
    assert verdict == "3 controllers in 10 trials with the same seeds of each: c did not complete all of them."
    assert lines[0] == "b_1: position error rms per axis 59 cm, attitude error rms per axis 5.5 degrees."
    assert [line.split(":")[0] for line in lines[:3]] == ["b_1", "a", "c (completed 8 of 10)"]
    assert lines[3] == "The position error rms per axis of b_1 is smaller than that of a, c: established."
    assert lines[4].startswith("No gains were searched for")


def test_the_answer_of_two_that_completed(findings):
    """`b_1` is established before `a`; of gains only those that were not tuned need a remark."""
    of_two = findings._replace(
        names=("a", "b_1"),
        differences=tuple(each for each in findings.differences if "c" not in (each.candidate, each.baseline)),
        successes={name: findings.successes[name] for name in ("a", "b_1")},
        tuning={
            "a": "tuned by `undertow tune` (search)",
            "b_1": "gains given (frequency 2), not tuned by `undertow tune`",
        },
    )
    good, verdict, lines = answer_of_comparison(of_two, "controller")
    assert good is True and verdict.endswith("of each: all completed within the criterion of success.")
    assert lines[2:] == (
        "The position error rms per axis of b_1 is smaller than that of a: established.",
        "b_1: gains given (frequency 2), not tuned by `undertow tune`.",
    )
    few = tuple(each._replace(pairs=3) for each in of_two.differences)
    line = answer_of_comparison(of_two._replace(differences=few), "controller").lines[2]
    assert line.startswith("3 trials that both completed are too few to establish a difference: it takes ")
    alone = of_two._replace(differences=tuple(each._replace(p_holm=0.2) for each in of_two.differences))
    line = answer_of_comparison(alone, "controller").lines[2]
    assert line == "Between b_1 and a no difference in position error rms per axis is established."


def test_the_answer_where_nothing_differs(findings):
    """Two names of one law: no test was made, and none is established."""
    zero = tuple(each._replace(smaller=0, larger=0, median=0.0, low=0.0, high=0.0) for each in findings.differences)
    lines = answer_of_comparison(findings._replace(differences=zero), "controller").lines
    assert lines[3] == "Between b_1 and a, c no difference in position error rms per axis is established."


def test_one_that_never_completed_hides_nothing_of_the_others(findings):
    """Without a pair with `c`, what stands between `a` and `b_1` is said as it is without `c`."""
    alone = [
        each._replace(pairs=0, p_holm=np.nan) if "c" in (each.candidate, each.baseline) else each
        for each in findings.differences
    ]
    lines = answer_of_comparison(findings._replace(differences=tuple(alone)), "controller").lines
    assert lines[3] == "The position error rms per axis of b_1 is smaller than that of a: established."
    assert not any("c" == word.strip(".,") for line in lines[4:] for word in line.split())


@pytest.mark.parametrize(
    "sentence", ["default gains of `pid`, not tuned", "gains from the rule of `controllers/bandwidths.py`"]
)
def test_gains_that_nobody_searched_for(findings, sentence):
    answer = answer_of_comparison(findings._replace(tuning=dict.fromkeys(findings.names, sentence)), "controller")
    assert answer.lines[-1].startswith("No gains were searched for: `--tune 60`")
