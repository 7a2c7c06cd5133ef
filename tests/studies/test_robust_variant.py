"""The last chapter: what is run, what is concluded from made-up numbers, and how it stands on the page."""

import re
from pathlib import Path

import numpy as np
import pytest

from undertow.paper.ablations import verdicts
from undertow.paper.figures.ablations import ablations_figure
from undertow.paper.figures.fidelity import robust_fidelity_figure
from undertow.paper.pages.ablations_page import ablations_page
from undertow.paper.pages.report import write_report
from undertow.paper.robust_variant import fidelity
from undertow.paper.robust_variant.conclusions import conclusions
from undertow.report.page import Html
from undertow.scenario.reading import from_data
from undertow.scenario.validation import validate

pytestmark = pytest.mark.full

FOLDER = Path(verdicts.__file__).parent
ABLATIONS_OF_THE_PAPER = verdicts.ABLATIONS


def spread(median):
    return {
        "median": median,
        "low": median / 2,
        "high": median * 2,
        "median_low": median * 0.9,
        "median_high": median * 1.1,
    }


def ablation(identity, medians, failures=0):
    variants = [
        {
            "name": name,
            "settings": "as given",
            "seeds": 30,
            "failures": failures,
            "metrics": {"tracking_rms": spread(m), "weights_peak": spread(m)},
        }
        for name, m in medians.items()
    ]
    entries = {
        "campaigns": [f"a{int(identity[1:]):02d}_made_up"],
        "question": "What?",
        "prediction": "This.",
        "agrees": "partly",
        "answer": "So.",
        "left_out": "all else",
    }
    return {"id": identity, **entries, "variants": variants}


def row(place, law, tracking=None, ended=None):
    metrics = dict.fromkeys(("estimation_rms", "input_rms", "input_variation", "saturated_fraction"), 0.5)
    return {
        "place": place,
        "words": f"at {place}",
        "law": law,
        "name": law,
        "scenario": f"scenarios/robust_variant_{place}_{law}.yaml",
        "status": "completed" if ended is None else "diverged",
        "diverged_at": ended,
        "steady": None
        if tracking is None
        else metrics | dict.fromkeys(("tracking_rms", "position_rms", "attitude_rms"), tracking),
        "largest_after": 1.25,
    }


ROWS = [
    row("electromechanical", "rcafc", ended=1.5),
    row("electromechanical", "robust", 3e-4),
    row("overload", "rcafc", 0.4),
    row("overload", "robust", 2e-5),
]
LINEAR = {"RCAFC": 1.0, "linear observer": 1.02, "robust": 1.0, "robust, 1 set": 1.0}
LINEAR |= {"robust's linear observer": 1.0, "robust's INDI": 1.0}
LIMITED = {"RCAFC, 1.5 m/s^2": 1e-5, "RCAFC, command fed, 1.5 m/s^2": 17.0, "RAFC, 1.5 m/s^2": 22.0}
ABLATIONS = [
    ablation("A3", LINEAR),
    ablation("A10", LIMITED),
    ablation("A18", {"nothing": np.inf, "projection 6": 0.1, "one set": 0.2}, failures=30),
]


def test_conclusions_say_what_the_numbers_say():
    found = conclusions(ROWS, ABLATIONS)
    assert len(found["wins"]) == 1 and "in the model it is 17 m, that of RAFC 22 m (A10)" in found["wins"][0]
    assert (
        found["same"][0] == "Accuracy. A linear observer of the same bandwidth has 1.020 times the error of RCAFC (A3)."
    )
    assert len(found["same"]) == 2 and "of INDI 1.0000" in found["same"][1]
    (motor, drift), (again,) = found["loses"], found["neither"]
    assert "30 of 30 runs end within 20 s" in drift and "keep 0.1 m" in drift
    assert "ends after 1.5 s" in motor and "0.0003" in motor
    assert "up to 1.2 m or rad, after 7.5 s back at 2e-05; that of Table 1 is up to 1.2, then 0.4." in again


def test_a_win_that_is_none_is_not_told():
    even = [ablation("A10", dict.fromkeys(LIMITED, 1e-5))]
    assert conclusions([], even) == {"wins": [], "same": [], "loses": [], "neither": []}


@pytest.mark.parametrize("quick", [True, False])
def test_every_run_of_the_fidelity_comparison_is_a_scenario(quick):
    found = fidelity.scenarios(quick)
    assert all(validate(from_data(one)).loop.kind == "sampled" for one in found.values())
    assert ("robust_variant_sea_robust" in found) is not quick


def test_robust_meets_the_same_as_table_1():
    runs = fidelity.runs(False)
    ours = {run.place: run.scenario for run in runs if run.law == "robust"}
    for run in runs:
        for key in ("plant", "disturbance", "reference", "loop"):
            assert ours[run.place][key] == run.scenario[key]


def test_dots_stand_at_the_medians():
    panel = ablations_figure(ABLATIONS).axes[0]
    dots = [line.get_xdata()[0] for line in panel.lines if line.get_marker() == "o"]
    assert dots == list(LINEAR.values())
    lost = ablations_figure(ABLATIONS[2:]).axes[0]
    assert next(line.get_marker() for line in lost.lines) == "X"


def test_a_run_that_ended_early_is_a_cross():
    panel = robust_fidelity_figure(ROWS, {}).axes[0]
    assert sorted(line.get_marker() for line in panel.lines) == ["X", "^", "^", "o"]


def test_the_chapter_on_the_page(tmp_path):
    chapter = {
        "quick": True,
        "seeds": 8,
        "left_out": ["A2"],
        "fidelity": ROWS,
        "ablations": ABLATIONS,
        "conclusions": conclusions(ROWS, ABLATIONS),
    }
    first = write_report({"robust_variant": chapter}, {"ablations": ablations_figure(ABLATIONS)}, tmp_path)
    second = (tmp_path / "ablations.html").read_text("utf-8")
    page = first.read_text("utf-8")
    words = re.sub(r"<[^>]+>", "", page)
    for said in ("The robust variant", "Disadvantages of the paper", "leaves out A2", "30 of 30", "diverged at 1.5 s"):
        assert said in words
    colours = set(re.findall(r'<span class="chip (\w+)">(completed|diverged)', page))
    assert colours == {("holds", "completed"), ("partly", "completed"), ("fails", "diverged")}
    assert "completed with an rms error below 0.05 m in position and 2.86 deg in attitude" in words
    assert words.count("scenarios/robust_variant_") == len(ROWS)
    assert "figure-ablations" in second and "figure-ablations" not in page
    words = re.sub(r"<[^>]+>", "", second)
    assert "are random, with 8 seeds" in words and "most ended early" in words


def test_both_pages_link_each_other(tmp_path):
    chapter = {"quick": False, "seeds": 8, "left_out": [], "fidelity": ROWS, "ablations": ABLATIONS}
    page = write_report({"robust_variant": chapter | {"conclusions": conclusions(ROWS, ABLATIONS)}}, {}, tmp_path)
    first, second = page.read_text("utf-8"), (tmp_path / "ablations.html").read_text("utf-8")
    linked = re.findall(r'href="ablations.html(?:#(\w+))?"', first)
    assert set(linked) == {"", "A3", "A10", "A18"} and linked.count("A3") == 1
    assert set(linked) - {""} <= set(re.findall(r'id="(\w+)"', second))
    assert 'href="report.html"' in second and "src=" not in second


def test_every_ablation_names_its_file_and_the_command_that_runs_it(tmp_path):
    """With the names that results.json would have; the files are those of the package."""
    found = [ablation(one.id, {"a": 1.0}) | {"campaigns": list(one.campaigns)} for one in ABLATIONS_OF_THE_PAPER]
    chapter = {"seeds": 8, "left_out": [], "ablations": found}
    words = re.sub(r"<[^>]+>", "", ablations_page(chapter, Html(""), "report.html"))
    named = re.findall(r"undertow/paper/ablations/(\w+\.yaml)", words)
    assert len(named) >= 21 and all((FOLDER / file).is_file() for file in named)
    assert {path.name for path in FOLDER.glob("a*_*.yaml")} == set(named)
    assert re.findall(r"undertow campaign campaigns/(\S+)", words) == named
