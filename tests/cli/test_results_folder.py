"""Where results go: refused before anything is computed, never half-written, never silently destroyed."""

import pytest
from good_scenario import SCENARIO

from undertow.cli.results_folder import next_free, results_folder
from undertow.core.errors import BadInput

NAMES = ("run.nc", "figures")


def fill(staging, text="new"):
    (staging / "run.nc").write_text(text)
    (staging / "figures").mkdir()
    (staging / "figures" / "a.svg").write_text(text)


def test_appears_whole_with_its_parents(tmp_path):
    folder = tmp_path / "a" / "b"
    with results_folder(folder, NAMES, "run.nc", overwrite=False) as staging:
        fill(staging)
        assert not folder.exists()
    assert sorted(path.name for path in folder.rglob("*")) == ["a.svg", "figures", "run.nc"]
    assert [path.name for path in folder.parent.iterdir()] == ["b"]


def test_nothing_is_left_of_a_failure(tmp_path):
    with pytest.raises(KeyboardInterrupt), results_folder(tmp_path / "a" / "b", NAMES, "run.nc", False) as staging:
        fill(staging)
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_other_files_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with results_folder(tmp_path, NAMES, "run.nc", overwrite=False) as staging:
        fill(staging)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["figures", "notes.txt", "run.nc"]


def test_earlier_result_is_kept_unless_told(tmp_path):
    with results_folder(tmp_path / "o", NAMES, "run.nc", overwrite=False) as staging:
        fill(staging, "old")
    with (
        pytest.raises(BadInput, match="without an earlier result"),
        results_folder(tmp_path / "o", NAMES, "run.nc", False),
    ):
        pass
    with pytest.raises(OSError), results_folder(tmp_path / "o", NAMES, "run.nc", overwrite=True) as staging:
        raise OSError
    assert (tmp_path / "o" / "run.nc").read_text() == "old"
    with results_folder(tmp_path / "o", NAMES, "run.nc", overwrite=True) as staging:
        fill(staging)
    assert (tmp_path / "o" / "figures" / "a.svg").read_text() == "new"
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == ["figures", "run.nc"]


def test_what_undertow_did_not_write_is_never_replaced(tmp_path):
    (tmp_path / "figures").mkdir()
    with pytest.raises(BadInput, match="without files of these names"):
        with results_folder(tmp_path, NAMES, "run.nc", overwrite=True):
            pass


def test_next_free(tmp_path):
    folder = tmp_path / "w1"
    assert next_free(folder) == folder
    folder.mkdir()
    assert next_free(folder) == folder
    (folder / "run.nc").touch()
    (tmp_path / "w1-2").touch()
    assert next_free(folder) == tmp_path / "w1-3"


@pytest.mark.parametrize(
    ("out", "said"),
    [
        ("file", "`--out` must be a folder, but is file, and file is a file"),
        ("file/below", "`--out` must be a folder, but is file/below, and file is a file"),
        (
            "/proc/undertow",
            "`--out` must be a folder that can be written, but is /proc/undertow: No such file or directory",
        ),
    ],
)
def test_impossible_folder_is_refused_before_the_scenario_is_read(refused, tmp_path, out, said):
    (tmp_path / "file").touch()
    (tmp_path / "s.yaml").write_text(SCENARIO)
    assert refused("simulate", "s.yaml", "--out", out) == said


def test_earlier_result_is_refused(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "run.nc").touch()
    assert refused("simulate", "s.yaml", "--out", "out") == (
        "`--out` must be a folder without an earlier result, but is out, which has run.nc. "
        "Add --overwrite to replace it, or choose another folder"
    )
