"""Figures of a comparison: what they draw is what the tables say, and nothing is drawn that is the same for all."""

import numpy as np
import pytest
import xarray as xr

from undertow.report.figures.comparison import alike, comparison_plots
from undertow.studies.comparison.findings import find

pytestmark = pytest.mark.full

NAMES, TRIALS, TIME = ["a", "b"], 6, np.linspace(0.0, 20.0, 101)


@pytest.fixture
def compared():
    """Both go 1 m north within 5 s and hold there; `a` to 3 mm, `b` to 10 mm, which fails at 15 s in the first trial."""
    rng, along = np.random.default_rng(0), ("controller", "sample", "time", "axis")
    reference = np.stack([np.minimum(TIME / 5, 1.0), 0 * TIME, 0 * TIME], axis=-1)
    error = np.array([0.003, 0.01])[:, None, None, None] * rng.normal(size=(2, TRIALS, len(TIME), 3))
    rms = np.sqrt((error[:, :, TIME >= 10] ** 2).mean((2, 3)))
    status, ended = np.zeros((2, TRIALS), np.int8), np.full((2, TRIALS), 20.0)
    status[1, 0], ended[1, 0] = 1, 15.0
    each = ("controller", "sample")
    dataset = xr.Dataset(
        {
            "position_rms": (each, rms, {"units": "m"}),
            "saturated_fraction": (each, 0 * rms, {"units": "1"}),
            "status": (each, status),
            "ended": (each, ended),
            "success": (each, np.where(status == 0, 1, -1)),
            "series:error": (along, error),
            "series:position": (along, reference - error),
            "series:reference": (along, np.broadcast_to(reference, error.shape)),
        },
        {"controller": NAMES, "time": TIME, "axis": ("axis", ["north", "east", "down"], {"unit_of_each": "m, m, m"})},
    )
    metrics = ["position_rms", "saturated_fraction"]
    return dataset, find(dataset, "controller", metrics, dict.fromkeys(NAMES, ""), {})


def test_rms_of_the_error_over_time_is_the_metric(compared):
    dataset, found = compared
    (panel,) = comparison_plots(dataset, found)["histories"]().axes
    line = next(one for one in panel.lines if one.get_color() == "#0072b2")
    late = np.asarray(line.get_ydata())[TIME >= 10]
    assert np.sqrt((late**2).mean()) == pytest.approx(float(dataset["position_rms"][0, 0]), rel=1e-12)


def test_metric_that_is_the_same_for_all_has_no_panel(compared):
    dataset, found = compared
    assert alike(dataset, found) == {"saturated_fraction": 0.0}
    for name in ("differences", "distributions"):
        assert [panel.get_xlabel() for panel in comparison_plots(dataset, found)[name]().axes] == [
            "position error, rms per axis, m"
        ]


def test_paths_have_one_scale_and_the_second_half_another(compared):
    dataset, found = compared
    panels = comparison_plots(dataset, found)["plan"]().axes
    words = [panel.get_title(loc="left") for panel in panels]
    assert words == ["a, whole run", "b, whole run", "a, 10 to 20 s", "b, 10 to 20 s"]
    limits = [(*panel.get_xlim(), *panel.get_ylim()) for panel in panels]
    assert limits[0] == limits[1] and limits[2] == limits[3]
    held = dataset["series:position"].sel(controller="a", sample=0, axis="north").values[TIME >= 10]
    assert limits[2][2] < held.min() and held.max() < limits[2][3] < 1.05, "of the completed runs"
    for panel in panels:  # a metre is as long to the north as to the east
        shown, size = panel.get_position(), panel.figure.get_size_inches()
        east, north = np.ptp(panel.get_xlim()), np.ptp(panel.get_ylim())
        assert shown.width * size[0] / east == pytest.approx(shown.height * size[1] / north)


def test_dominated_candidates_are_pale_and_failed_ones_hollow(compared):
    """`a` has the smaller error and the smaller effort; `c` neither; `b` failed in one trial."""
    dataset, _ = compared
    third = dataset.isel(controller=[0]).assign_coords(controller=["c"])
    third["position_rms"] = 2 * third["position_rms"]
    dataset = xr.concat([dataset, third], "controller")
    effort = np.stack([np.full(TRIALS, size) for size in (1.0, 0.5, 3.0)])
    dataset["input_rms"] = (("controller", "sample"), effort, {"units": "V"})
    found = find(dataset, "controller", ["position_rms", "input_rms"], dict.fromkeys(["a", "b", "c"], ""), {})
    (front,) = found.fronts
    assert (front.front, front.incomplete) == (("a",), ("b",))
    (panel,) = comparison_plots(dataset, found)["pareto"]().axes
    points = {line.get_color(): line for line in panel.lines if line.get_marker() == "o"}
    a, b, c = points.values()
    assert (a.get_alpha(), c.get_alpha()) == (1.0, 0.3)
    assert b.get_markerfacecolor() == "white" != a.get_markerfacecolor()
    assert [float(a.get_xdata()[0]), float(c.get_xdata()[0])] == [1.0, 3.0]
    assert float(a.get_ydata()[0]) == found.medians["position_rms"]["a"].value
    assert [text.get_text() for text in panel.texts] == ["a", "b", "c"]
    # Of a point in the right half the name stands to the left, so that a long one is not cut off.
    assert [text.get_horizontalalignment() for text in panel.texts] == ["left", "left", "right"]
