"""The figure of a certificate: the recorded lines, shades where something was at a limit, on any kind of run."""

import json

import numpy as np
import pytest

from undertow.report.figures import run_figures, svg
from undertow.report.plotted import Shown
from undertow.scenario.results.run_facts import facts_from

pytestmark = pytest.mark.full


@pytest.fixture
def certified(make_run):
    """A run with a certificate: V falls for 10 s and rises again, inputs at a limit from 5 to 6 s."""

    def make(bound=8.0, alone=False, **choices):
        run = make_run(axes=2, inputs=3, **choices)
        time = run["time"].values
        value = np.exp(-time) + np.where(time > 10, time - 10, 0.0)
        rate = np.concatenate([[np.nan], np.diff(value) / np.diff(time)])
        columns = {
            "lyapunov": value,
            "lyapunov_estimation": value if alone else value / 4,
            "lyapunov_tracking": 3 * value / 4,
            "lyapunov_rate": rate,
            "weights_peak": 8 * np.minimum(time / 10, 1),
            "weights_at_bound": np.where(time >= 10, 0.5, 0.0),
        }
        for name, values in columns.items():
            run[name] = ("time", values)
        run["saturated"] = (("time", "actuator"), np.zeros((len(time), 3)))
        run["saturated"][50:60, 1] = 1.0
        run.attrs["certificate"] = json.dumps({"weights_bound": [bound, 1.0]})
        return run

    return make


def lines(panel):
    return {one.get_label(): one.get_ydata() for one in panel.lines}


def spans(panel):
    """Times between which each shade lies."""
    found = []
    for shade in panel.collections:
        found += [(path.get_extents().x0, path.get_extents().x1) for path in shade.get_paths()]
    return found


def test_lines_and_shades_are_the_data(certified):
    run = certified()
    figure = run_figures(Shown(run, certificate=facts_from(run.attrs).certificate))["certificate"]
    value, rate, weights = figure.axes
    np.testing.assert_array_equal(lines(value)["V"], run["lyapunov"])
    np.testing.assert_array_equal(lines(value)["tracking part"], run["lyapunov_tracking"])
    np.testing.assert_array_equal(lines(rate)["dV/dt"], run["lyapunov_rate"])
    assert (lines(weights)["bound"] == 8.0).all() and value.get_yscale() == "log"
    for panel in figure.axes:
        assert spans(panel) == [pytest.approx((5.0, 6.0)), pytest.approx((10.0, 20.0))]
    assert [panel.get_ylabel().rsplit(", ", 1)[-1] for panel in figure.axes] == [
        "m$^2$/s$^2$", "m$^2$/s$^3$", "m/s$^2$",
    ]  # fmt: skip
    assert len(svg(figure)) < 400_000


def test_where_tracking_is_no_part_of_v_the_key_says_so(certified):
    names = list(lines(run_figures(Shown(certified(alone=True)))["certificate"].axes[0]))
    assert names == ["V of the estimator", "tracking, not in V"]


def test_without_a_bound_none_is_drawn(certified):
    run = certified(bound=None)
    assert list(
        lines(run_figures(Shown(run, certificate=facts_from(run.attrs).certificate))["certificate"].axes[2])
    ) == [r"largest |$\theta$|"]


def test_a_run_that_failed_is_drawn_up_to_its_end(certified):
    run = certified(status="diverged", ended=3.3)
    run["lyapunov"][40:] = np.inf
    figure = run_figures(Shown(run, certificate=facts_from(run.attrs).certificate))["certificate"]
    assert "diverged at 3.3 s" in figure.texts[0].get_text()
    assert max(figure.axes[0].lines[0].get_xdata()) <= 3.3 and svg(figure)


def test_an_older_result_has_no_certificate(make_run):
    assert "certificate" not in run_figures(Shown(make_run()))


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_run_that_overflows_has_its_figure(certified):
    """Up to 1e308: the axes end below what a logarithmic axis can have, and a unit has the power of ten of its axis."""
    run = certified(bound=np.inf)
    time = run["time"].values
    for name in ("lyapunov", "lyapunov_estimation", "lyapunov_rate", "weights_peak"):
        run[name] = ("time", 10.0 ** np.minimum(308 * time / time[-1], 308))
    figure = run_figures(Shown(run, certificate=facts_from(run.attrs).certificate))["certificate"]
    figure.canvas.draw()
    for panel in figure.axes:
        assert np.isfinite(panel.get_ylim()).all() and panel.get_ylim()[1] > 1e80
    assert "10^{99}" in figure.axes[2].get_ylabel() or "10^{96}" in figure.axes[2].get_ylabel()
