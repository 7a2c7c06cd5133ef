"""Where results go: refused before anything is computed, never half-written, never silently destroyed."""

import os

import pytest
from good_scenario import SCENARIO
from matplotlib.figure import Figure
from messages import named

from undertow.cli.results_folder import output_folder, results_folder
from undertow.core.errors import BadInput

NAMES = ("run.nc", "figures")


def fill(staging, text="new"):
    (staging / "run.nc").write_text(text)
    (staging / "figures").mkdir()
    (staging / "figures" / "a.svg").write_text(text)


def test_appears_whole_with_its_parents(tmp_path):
    folder = tmp_path / "a" / "b"
    with results_folder(folder, NAMES, "run.nc", overwrite=False) as draft:
        fill(draft.path)
        assert not folder.exists()
    assert sorted(path.name for path in folder.rglob("*")) == ["a.svg", "figures", "run.nc"]
    assert [path.name for path in folder.parent.iterdir()] == ["b"]


def test_nothing_is_left_of_a_failure(tmp_path):
    folder = tmp_path / "a" / "b"
    with pytest.raises(KeyboardInterrupt), output_folder(folder, folder):
        with results_folder(folder, NAMES, "run.nc", False) as draft:
            fill(draft.path)
            raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_other_files_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with results_folder(tmp_path, NAMES, "run.nc", overwrite=False) as draft:
        fill(draft.path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figures", "notes.txt", "run.nc"]


def test_earlier_result_is_kept_unless_told(tmp_path):
    with results_folder(tmp_path / "o", NAMES, "run.nc", overwrite=False) as draft:
        fill(draft.path, "old")
    with (
        pytest.raises(BadInput, match="without an earlier result"),
        results_folder(tmp_path / "o", NAMES, "run.nc", False),
    ):
        pass
    with pytest.raises(OSError), results_folder(tmp_path / "o", NAMES, "run.nc", overwrite=True) as draft:
        raise OSError
    assert (tmp_path / "o" / "run.nc").read_text() == "old"
    with results_folder(tmp_path / "o", NAMES, "run.nc", overwrite=True) as draft:
        fill(draft.path)
    assert (tmp_path / "o" / "figures" / "a.svg").read_text() == "new"
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == ["figures", "run.nc"]


def test_what_undertow_did_not_write_is_never_replaced(tmp_path):
    (tmp_path / "figures").mkdir()
    with pytest.raises(BadInput, match="without files of the names of results"):
        with results_folder(tmp_path, NAMES, "run.nc", overwrite=True):
            pass


def chosen(default):
    with output_folder(None, default) as folder:
        return folder


def test_default_folder_is_the_first_that_is_free(tmp_path):
    folder = tmp_path / "w1"
    assert chosen(folder) == folder
    folder.mkdir()
    assert chosen(folder) == folder
    (folder / "run.nc").touch()
    (tmp_path / "w1-2").touch()
    assert chosen(folder) == tmp_path / "w1-3"


def test_two_at_once_take_two_folders(tmp_path):
    """Nobody says where: the second takes the next folder. Both want the same one: the second is told."""
    folder = tmp_path / "runs" / "w1"
    with output_folder(None, folder) as first, output_folder(None, folder) as second:
        assert (first, second) == (folder, tmp_path / "runs" / "w1-2")
        with pytest.raises(BadInput, match="be a folder that nothing else writes to"), output_folder(first, first):
            pass
    assert list(tmp_path.iterdir()) == []


def test_the_first_of_two_is_not_lost(tmp_path):
    """The second waits until the first has ended, then finds its result, though there was none when it began."""
    folder = tmp_path / "o"
    with output_folder(folder, folder), results_folder(folder, NAMES, "run.nc", False) as draft:
        fill(draft.path, "first")
    with pytest.raises(BadInput, match="without an earlier result"), output_folder(folder, folder):
        with results_folder(folder, NAMES, "run.nc", False):
            pass
    assert (folder / "run.nc").read_text() == "first"


@pytest.mark.parametrize("exists", [False, True])
def test_what_a_killed_process_left_is_cleared_away(tmp_path, exists):
    """Beside the folder, or in it where it was there; what somebody else left stays."""
    folder, other = tmp_path / "o", tmp_path / ".other.partial"
    for left in (other, (folder if exists else tmp_path) / ".o.partial"):
        left.mkdir(parents=True)
        (left / "half").touch()
    (tmp_path / ".o.lock").touch()
    with output_folder(None, folder) as chosen, results_folder(chosen, NAMES, "run.nc", False) as draft:
        assert chosen == folder and list(draft.path.iterdir()) == []
        fill(draft.path)
    assert sorted(path.name for path in folder.iterdir()) == ["figures", "run.nc"]
    assert sorted(path.name for path in tmp_path.iterdir()) == [".other.partial", "o"]


def test_what_is_published_stays_whatever_follows(tmp_path):
    folder = tmp_path / "o"
    for _ in range(2):  # new, and in place of an earlier one
        with pytest.raises(KeyboardInterrupt), results_folder(folder, NAMES, "run.nc", overwrite=True) as draft:
            (draft.path / "run.nc").write_text("new")
            draft.publish()
            (draft.path / "figures").mkdir()
            raise KeyboardInterrupt
        assert [path.name for path in folder.iterdir()] == ["run.nc"] and list(tmp_path.iterdir()) == [folder]
        (folder / "figures").mkdir()  # of an earlier one


def test_a_folder_that_was_moved_and_linked_is_refused_before_anything_is_computed(tmp_path):
    """As figures on a bigger disk: neither they nor the earlier result are touched."""
    folder, bigger = tmp_path / "o", tmp_path / "bigger"
    with results_folder(folder, NAMES, "run.nc", overwrite=False) as draft:
        fill(draft.path, "old")
    (folder / "figures").rename(bigger)
    (folder / "figures").symlink_to(bigger)
    with pytest.raises(BadInput, match="no links"), results_folder(folder, NAMES, "run.nc", overwrite=True):
        pass
    assert (folder / "run.nc").read_text() == "old" == (bigger / "a.svg").read_text()


def test_a_link_to_nowhere_is_no_folder(tmp_path):
    (tmp_path / "o").symlink_to(tmp_path / "gone")
    with pytest.raises(BadInput, match="which is not there"), results_folder(tmp_path / "o", NAMES, "run.nc", False):
        pass


@pytest.mark.parametrize("there", [False, True])
def test_results_that_cannot_be_moved_are_kept(tmp_path, monkeypatch, capsys, there):
    """And so is the earlier one."""
    folder, replace = tmp_path / "o", os.replace
    if there:
        with results_folder(folder, NAMES, "run.nc", overwrite=False) as draft:
            fill(draft.path, "old")
    failing = [True]

    def failing_once(old, new):
        if failing and failing.pop():
            raise OSError("No space left on device")
        replace(old, new)

    monkeypatch.setattr(os, "replace", failing_once)
    with pytest.raises(OSError, match="No space"), results_folder(folder, NAMES, "run.nc", overwrite=True) as draft:
        fill(draft.path)
    (place,) = tmp_path.rglob("o-rescued-1")
    assert f"The results are in {place}." in capsys.readouterr().err
    assert (place / "run.nc").read_text() == "new" == (place / "figures" / "a.svg").read_text()
    assert not there or (folder / "run.nc").read_text() == "old"
    with results_folder(folder, NAMES, "run.nc", overwrite=True) as draft:
        fill(draft.path)
    assert (place / "run.nc").exists(), "the next command leaves them alone"


@pytest.mark.parametrize(
    ("out", "said"),
    [
        ("file", "`--out` must be a folder, but is file, a file. Choose another name"),
        ("file/below", "`--out` must be a folder, but is file/below, and file is a file. Choose another name"),
        (
            "/proc/undertow",
            "`--out` must be a folder that can be made and written, but is /proc/undertow, where nothing can be written (No such file or directory). Choose another folder",
        ),
    ],
)
def test_impossible_folder_is_refused_before_the_scenario_is_read(refused, tmp_path, out, said):
    (tmp_path / "file").touch()
    (tmp_path / "s.yaml").write_text(SCENARIO)
    assert named(refused("simulate", "s.yaml", "--out", out)) == named(said)


def test_earlier_result_is_refused(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "run.nc").touch()
    assert refused("simulate", "s.yaml", "--out", "out") == (
        "`--out` must be a folder without an earlier result, but is out, which has run.nc. "
        "Add --overwrite to replace it, or choose another folder"
    )


@pytest.mark.full
def test_a_figure_that_fails_costs_no_results(undertow, tmp_path, monkeypatch):
    """It is a warning; the other figures are drawn, and the exit code is that of the run."""

    def plots(*_):
        return {"tracking": lambda: 1 / 0, "error": Figure}

    monkeypatch.setattr("undertow.report.figures.run_files.run_plots", plots)
    (tmp_path / "s.yaml").write_text(SCENARIO)
    said = undertow("simulate", "s.yaml", "--out", "out")
    assert said.code == 0
    line = (
        "Warning: figure `tracking` could not be made (ZeroDivisionError: division by zero); the results are complete"
    )
    assert line in said.err.splitlines()
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "figures",
        "metrics.json",
        "run.html",
        "run.mcap",
        "run.nc",
        "scenario.yaml",
    ]
    assert sorted(path.name for path in (tmp_path / "out" / "figures").iterdir()) == ["error.png"]


@pytest.mark.full
def test_an_interrupt_while_figures_are_drawn_costs_no_results(undertow, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("undertow.report.figures.run_files.run_plots", interrupted)
    (tmp_path / "s.yaml").write_text(SCENARIO)
    assert undertow("simulate", "s.yaml", "--out", "out").code == 130
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["metrics.json", "run.nc", "scenario.yaml"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "s.yaml"]
