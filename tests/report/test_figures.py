import threading
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from PIL import Image

from undertow.paper.figures.fidelity import fidelity_figure
from undertow.paper.figures.paper import effort, paper_figures, uncertainty
from undertow.paper.figures.sweep import sweep_figure
from undertow.paper.thruster_response import thruster_response
from undertow.report.figures import png, run_figures, save, svg
from undertow.report.figures.limits import fit_linear
from undertow.report.figures.prediction import prediction_plots
from undertow.report.plotted import Shown

pytestmark = pytest.mark.full

AXES = ["north", "east", "down", "roll", "pitch", "yaw"]


@pytest.fixture(scope="module")
def figures(runs):
    return paper_figures(runs, runs, thruster_response())


def titled(figure, name):
    """Panel of a name, and the one after it."""
    at = [panel.get_title(loc="left") for panel in figure.axes].index(name)
    return figure.axes[at], figure.axes[at + 1]


def line(panel, name):
    return next(one for one in panel.lines if one.get_label() == name)


def test_names_and_panels(figures):
    assert list(figures) == ["fig02", *(f"fig{n:02d}" for n in range(6, 14))]
    for name in ("fig06", "fig07", "fig08", "fig10", "fig11", "fig12"):
        assert len(figures[name].axes) == 12
        assert [p.get_title(loc="left") for p in figures[name].axes if p.get_title(loc="left")] == AXES
    for name in ("fig09", "fig13"):
        titles = [p.get_title(loc="left") for p in figures[name].axes if p.get_title(loc="left")]
        assert titles == [f"T{n}" for n in range(1, 9)]


def test_key_of_the_poles_covers_none():
    """Poles in all corners of the panel: the key has no part of it, and names every operating point."""
    corners = np.array([-100 + 100j, -100 - 100j, -0.01 + 100j, -0.01 - 100j, -100, -0.01])
    points = tuple(SimpleNamespace(poles=corners, where=where) for where in ("calm", "mean load", "0.95 quantile"))
    no_limit = SimpleNamespace(high=np.array([np.inf]))
    figure = prediction_plots(SimpleNamespace(points=points, authority=no_limit))["poles"]()
    (panel,), (key,) = figure.axes, figure.legends
    renderer = FigureCanvasAgg(figure).get_renderer()
    assert panel.get_legend() is None and not key.get_window_extent(renderer).overlaps(panel.get_tightbbox(renderer))
    assert [text.get_text() for text in key.get_texts()] == ["calm", "mean load", "0.95 quantile"]


def test_every_panel_says_its_unit(figures):
    for name, figure in figures.items():
        for panel in figure.axes:
            said = panel.get_ylabel() or panel.get_xlabel()
            assert said.rsplit(", ", 1)[-1] in (
                "m", "rad", "mm", "mrad", "m/s$^2$", "rad/s$^2$", "V", "N", "% of rms",
            ), (name, said)  # fmt: skip


def test_units_follow_the_axis(figures):
    assert titled(figures["fig06"], "down")[0].get_ylabel() == "position, m"
    assert titled(figures["fig06"], "yaw")[0].get_ylabel() == "angle, rad"
    assert titled(figures["fig07"], "yaw")[1].get_ylabel().endswith(", rad/s$^2$")


def test_lines_are_the_data(figures, runs):
    for column, axis in enumerate(AXES):
        upper, lower = titled(figures["fig06"], axis)
        pick = lambda run, name, column=column: run[name].values[:, column]
        np.testing.assert_array_equal(line(upper, "RAFC").get_ydata(), pick(runs["rafc"], "position"))
        np.testing.assert_array_equal(line(upper, "desired $x_d$").get_ydata(), pick(runs["rcafc"], "reference"))
        np.testing.assert_array_equal(line(lower, "RCAFC").get_ydata(), abs(pick(runs["rcafc"], "error")))
        assert lower.get_yscale() == "log"
        upper, lower = titled(figures["fig07"], axis)
        np.testing.assert_array_equal(line(upper, "true $d$").get_ydata(), pick(runs["rcafc"], "uncertainty"))
        missed = pick(runs["rafc"], "estimate") - pick(runs["rafc"], "uncertainty")
        np.testing.assert_array_equal(line(lower, "RAFC").get_ydata(), missed)
        _, lower = titled(figures["fig11"], axis)
        np.testing.assert_allclose(lower.lines[0].get_ydata(), 2.0)  # mm, mrad


def test_line_style_carries_the_meaning(figures):
    panel, _ = titled(figures["fig07"], "north")
    assert line(panel, "RCAFC").get_linestyle() == "-"
    assert line(panel, "RAFC").get_linestyle() == "--"
    assert line(panel, "true $d$")._unscaled_dash_pattern[1][0] < 1.5
    assert [one.get_label() for one in titled(figures["fig10"], "north")[0].lines] == ["desired $x_d$", "RCAFC"]


def test_what_leaves_a_panel_is_written_above_it(figures):
    panel, _ = titled(figures["fig07"], "north")
    assert panel.get_ylim()[1] < 10
    assert any("first 1 s" in text.get_text() and "RCAFC to 40" in text.get_text() for text in panel.texts)


@pytest.mark.parametrize(
    "applied, said", [(-9.0, "first 1 s: to \u22129"), (-8.0, "commanded to \u22129, applied to \u22128")]
)
def test_what_is_the_same_of_all_curves_is_written_once(applied, said):
    """Beside the name of a thruster there is no room for more."""
    time, rest = np.linspace(0.0, 10.0, 101), np.sin(np.linspace(0.0, 10.0, 101))
    series = [
        (name, time, np.where(time < 0.5, low, rest)) for name, low in (("commanded", -9.0), ("applied", applied))
    ]
    panel = Figure().subplots()
    fit_linear(panel, series, 1.0)
    assert panel.texts[0].get_text().endswith(said)


def test_voltages_are_split_into_start_and_rest(figures, runs):
    start, rest = titled(figures["fig09"], "T3")
    drawn = np.concatenate([line(p, "RCAFC").get_ydata() for p in (start, rest)])
    volts = runs["rcafc"]["input"].values[:, 2]
    assert start.get_xlim() == pytest.approx((0, 1))
    assert rest.get_xlim() == pytest.approx((1, 20))
    assert len(drawn) in (len(volts), len(volts) + 1)
    assert set(drawn) == set(volts)


def test_thruster_figure_draws_both_periods_and_the_laws(figures):
    response = thruster_response()
    current, voltage, errors = figures["fig02"].axes
    np.testing.assert_array_equal(current.lines[0].get_xdata(), response.long.current)
    np.testing.assert_array_equal(voltage.lines[1].get_ydata(), response.short.thrust)
    lengths = sorted(bar.get_width() for bar in errors.patches)
    assert lengths == pytest.approx(sorted(e for law in response.laws for e in (law.error_long, law.error_short)))


def test_files_are_small_reproducible_and_valid(figures, tmp_path):
    figure = figures["fig02"]
    vector, raster = save(figure, tmp_path / "new", "fig02")
    assert vector.read_text() == svg(figure)
    assert raster.read_bytes() == png(figure)
    assert ElementTree.parse(vector).getroot().tag.endswith("svg")
    assert "dc:date" not in vector.read_text()
    with Image.open(raster) as image:
        assert image.width == pytest.approx(150 * figure.get_size_inches()[0], abs=1)


def test_the_fullest_figures_stay_small(make_run):
    """As many samples as a run of 20 s recorded every 10 ms, each of them far from the next."""
    runs = {name: make_run(name, samples=2001) for name in ("rcafc", "rafc")}
    for run in runs.values():
        run["input"] = run["input"] * np.cos(60 * run["time"])
        run["estimate"] = run["estimate"] * np.cos(20 * run["time"])
    for figure in (uncertainty("Fig. 7", runs), effort("Fig. 9", runs)):
        assert len(svg(figure)) < 400_000


def test_a_figure_made_while_another_thread_writes_is_the_same(make_run, monkeypatch):
    run = make_run(axes=1, inputs=1)
    alone, made = svg(run_figures(Shown(run))["tracking"]), []

    def write_meanwhile(canvas, *written, **how):
        made.append(run_figures(Shown(run))["tracking"])  # the settings for writing are held now
        return print_svg(canvas, *written, **how)

    print_svg = FigureCanvasSVG.print_svg
    with monkeypatch.context() as patch:
        patch.setattr(FigureCanvasSVG, "print_svg", write_meanwhile)
        svg(run_figures(Shown(run))["error"])
    assert [svg(figure) for figure in made] == [alone]


def test_drawing_in_two_threads_changes_nothing(make_run):
    run, found = make_run(axes=1, inputs=1), {}
    alone = svg(run_figures(Shown(run))["tracking"])

    def draw(number):
        found[number] = svg(run_figures(Shown(run))["tracking"])

    threads = [threading.Thread(target=draw, args=(number,)) for number in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(found.values()) == {alone}


@pytest.mark.parametrize(("axes", "inputs"), [(1, 1), (2, 2), (6, 8), (7, 5)])
def test_run_figures_for_any_size(make_run, axes, inputs):
    run = make_run(axes=axes, inputs=inputs)
    figures = run_figures(Shown(run))
    assert list(figures) == ["summary", "tracking", "error", "estimate", "effort"]
    assert [len(figure.axes) for figure in figures.values()][1:] == [axes, axes, axes, inputs]
    last = figures["effort"].axes[-1]
    np.testing.assert_array_equal(line(last, "applied").get_ydata(), run["input"].values[:, -1])
    np.testing.assert_array_equal(line(last, "commanded").get_ydata(), run["commanded_input"].values[:, -1])
    assert last.get_ylabel() == "input, V"


def test_a_sensor_that_errs_has_a_figure_of_its_own(make_run):
    run = make_run()
    run["measured_position"][:, 0] += 0.25
    run["measured_position"][:, 5] += 2 * np.pi - 0.125  # the same heading but for an eighth
    run["measured_velocity"][:, 2] -= 0.5
    figures = run_figures(Shown(run))
    assert list(figures) == ["summary", "tracking", "error", "estimate", "effort", "measurement"]
    position, _ = titled(figures["measurement"], "north")
    heading, _ = titled(figures["measurement"], "yaw")
    _, sinking = titled(figures["measurement"], "down")
    assert heading.get_ylabel().endswith(", deg")
    assert [panel.get_ylabel() for panel in figures["tracking"].axes] == ["position, m"] * 3 + ["angle, deg"] * 3
    for panel, apart in ((position, 0.25), (heading, np.degrees(-0.125)), (sinking, -0.5)):
        np.testing.assert_allclose(panel.lines[0].get_ydata(), apart, atol=1e-12)


def test_diverged_run_is_drawn_up_to_its_end(make_run):
    run = make_run(axes=2, inputs=2, status="diverged", ended=3.3)
    figures = run_figures(Shown(run))
    for figure in figures.values():
        assert "diverged at 3.3 s" in figure.texts[0].get_text()
        assert max(figure.axes[0].lines[0].get_xdata()) <= 3.3
        assert svg(figure)
    assert figures["effort"].axes[0].get_yscale() == "symlog"


def test_a_run_with_gaps_is_drawn(make_run):
    run = make_run(axes=2, inputs=1)
    run["estimate"][:, 0] = np.nan
    run["input"][100:] = np.inf
    for figure in run_figures(Shown(run)).values():
        assert svg(figure)


def test_fidelity_figure_marks_what_failed(results, make_run):
    alone = fidelity_figure(results["fidelity"])
    assert len(alone.axes) == 4
    tracking = alone.axes[0]
    assert line(tracking, "RAFC").get_ydata() == pytest.approx([1.6e-4, 1.6e-4])
    assert np.isnan(line(tracking, "RCAFC").get_ydata()[1])
    assert [text.get_text() for text in tracking.texts] == ["RCAFC diverged at 3.29 s"]
    pair = {"rcafc": make_run(status="diverged", ended=3.295), "rafc": make_run("rafc")}
    runs = {"ideal": {key: make_run(key) for key in pair}, "electromechanical": pair}
    whole = fidelity_figure(results["fidelity"], runs)
    assert [panel.get_title(loc="left") for panel in whole.axes[:2]] == ["ideal", "electromechanical"]
    assert line(whole.axes[1], "RCAFC, electromechanical").get_xdata()[-1] <= 3.295
    assert svg(whole)


def test_sweep_draws_points_and_theory():
    points = {"frequency": [1.0, 10.0], "measured": [0.01, 0.1], "theory_frequency": [1.0, 5.0, 10.0]}
    figure = sweep_figure({"rcafc": points | {"theory": [0.01, 0.05, 0.1]}, "rafc": points})
    panel = figure.axes[0]
    assert (panel.get_xscale(), panel.get_yscale()) == ("log", "log")
    assert line(panel, "RCAFC, theory").get_ydata() == pytest.approx([0.01, 0.05, 0.1])
    assert line(panel, "RAFC, measured").get_xdata() == pytest.approx([1.0, 10.0])
    assert "RAFC, theory" not in [one.get_label() for one in panel.lines]
    assert "rad/s" in panel.get_xlabel()


def test_signals_of_a_law_in_body_axes_have_their_names(make_run):
    """Its estimate is along surge, sway, ..., while position and error are north, east, ..."""
    run = make_run()
    run["axis"].attrs["controller_axes"] = "surge, sway, heave, roll, pitch, yaw"
    figures = run_figures(Shown(run))
    shown = lambda name: [at for panel in figures[name].axes if (at := panel.get_title(loc="left"))]
    assert shown("estimate")[:3] == ["surge", "sway", "heave"] and shown("tracking")[:3] == ["north", "east", "down"]


def test_results_without_names_have_numbers(make_run):
    run = make_run(axes=1, inputs=2)
    del run["actuator"].attrs["names"]
    assert [panel.get_title(loc="left") for panel in run_figures(Shown(run))["effort"].axes] == ["input 1", "input 2"]


@pytest.mark.parametrize(("unit", "label"), [("V", "\u00b5V"), ("N m", "\u00b5N m"), ("A^2", "$10^{-6}$ A^2")])
def test_small_values_have_a_prefix_or_their_power_of_ten_in_the_unit(make_run, unit, label):
    """A prefix before a power would be raised with it."""
    run = make_run(axes=1, inputs=1)
    run["input"] = (2e-5 * np.sin(run["time"]) + 0 * run["input"]).assign_attrs(units=unit)
    run["commanded_input"] = run["input"]
    panel = run_figures(Shown(run))["effort"].axes[0]
    assert panel.get_ylabel() == f"input, {label}"
    assert panel.yaxis.get_major_formatter()(-1e-5, 0) == "\u221210"
