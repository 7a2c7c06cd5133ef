"""Figures that a process of their own plots, whatever becomes of it."""

import pickle
import subprocess
import sys

import pytest

from undertow.report.figures.run_files import plot_run
from undertow.report.plotted import Plotted, Shown
from undertow.report.plotting import PlottingProcess, plotting_process
from undertow.scenario.results.run_facts import facts_from

pytestmark = pytest.mark.full

# Plots a run as the command does, and says whether this process needed matplotlib.
ELSEWHERE = """
import pickle, sys
from undertow.report.plotting import plotting_process
with plotting_process() as plotting:
    plotting.plot(pickle.load(open(sys.argv[1], "rb")), "wide")
    {meanwhile}
    found = plotting.plotted()
pickle.dump((found, "matplotlib" in sys.modules), open(sys.argv[2], "wb"))
"""


def shown(run):
    facts = facts_from(run.attrs)
    return Shown(run, facts.faults, facts.certificate)


@pytest.fixture(scope="module")
def here(runs):
    return plot_run(shown(runs["rafc"]), "wide")


def elsewhere(run, folder, meanwhile="pass"):
    (folder / "run").write_bytes(pickle.dumps(shown(run)))
    command = [sys.executable, "-P", "-c", ELSEWHERE.format(meanwhile=meanwhile), folder / "run", folder / "found"]
    subprocess.run(command, check=True, cwd=folder)
    return pickle.loads((folder / "found").read_bytes())


def test_the_same_files_as_here(runs, here, tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise SystemExit('the current folder must not be searched')")
    found, loaded = elsewhere(runs["rafc"], tmp_path)
    assert not loaded and found == here
    assert set(here.pictures) == {name.removesuffix(".pdf") for name in here.files if name.endswith(".pdf")}
    assert all(here.files[f"{name}.png"] == picture for name, picture in here.pictures.items())


def test_drawn_here_where_the_process_was_killed(runs, here, tmp_path):
    found, loaded = elsewhere(runs["rafc"], tmp_path, "plotting._process.kill()")
    assert loaded and found == here


def test_without_jax():
    """The process that plots starts while JAX does elsewhere; with JAX it would take twice as long."""
    code = "import sys, undertow.report.plotting; undertow.report.plotting.figures.plot_run; assert 'jax' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_failed_figure_is_a_sentence(monkeypatch, runs):
    from undertow.report.figures import run_files

    monkeypatch.setattr(run_files, "run_plots", lambda *_: {"error": lambda: 1 / 0})
    found = plot_run(shown(runs["rafc"]))
    assert found.files == found.pictures == {} and found.failures[0].startswith("figure `error` could not be made (")


def test_files_are_written(tmp_path):
    Plotted({"a.svg": b"<svg/>"}, {}, []).write(tmp_path / "figures")
    assert (tmp_path / "figures" / "a.svg").read_bytes() == b"<svg/>"


def test_no_process_where_matplotlib_is_loaded(runs, here):
    with plotting_process() as plotting:
        assert plotting._process is None
        plotting.plot(shown(runs["rafc"]), "wide")
        assert plotting.plotted() == here


def test_draw_comes_first():
    with pytest.raises(AssertionError, match="first"):
        PlottingProcess(None).plotted()
