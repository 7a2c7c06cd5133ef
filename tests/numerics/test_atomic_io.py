"""Files are written by one process at a time, whole, and are on the disk."""

import fcntl
import os
import subprocess
import sys

import pytest

from undertow.core import atomic_io, file_lock


def test_one_at_a_time_in_either_of_two_names(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "out", target_is_directory=True)
    with file_lock.file_lock(tmp_path / "out"):
        for path in (tmp_path / "out", tmp_path / "link"):
            with (
                pytest.raises(file_lock.InUse, match=r"^`--out` must be a folder that nothing else writes to"),
                file_lock.file_lock(path),
            ):
                pass
        with file_lock.file_lock(tmp_path / "another"):
            pass
    with file_lock.file_lock(tmp_path / "out"):
        pass
    assert [one.name for one in tmp_path.iterdir()] == ["link"]


def test_the_lock_is_released_by_an_error(tmp_path):
    with pytest.raises(ZeroDivisionError), file_lock.file_lock(tmp_path / "out"):
        raise ZeroDivisionError
    with file_lock.file_lock(tmp_path / "out"):
        pass


LOCK_AND_WAIT = """
import sys
from pathlib import Path
from undertow.core.file_lock import file_lock
with file_lock(Path(sys.argv[1])):
    print("locked", flush=True)
    sys.stdin.read()
"""


@pytest.mark.full
def test_the_lock_ends_with_a_killed_process(tmp_path):
    out = tmp_path / "out"
    with subprocess.Popen(
        [sys.executable, "-c", LOCK_AND_WAIT, str(out)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as owner:
        assert owner.stdout.readline() == "locked\n"
        with pytest.raises(file_lock.InUse), file_lock.file_lock(out):
            pass
        owner.kill()
    assert file_lock.lock_of(out).exists()
    with file_lock.file_lock(out):
        pass
    assert not file_lock.lock_of(out).exists()


def test_a_lock_whose_file_was_removed_meanwhile_is_taken_again(tmp_path, monkeypatch):
    """Between opening and locking, its owner ends and removes it."""
    lock, flock, opened = file_lock.lock_of(tmp_path / "out"), fcntl.flock, []

    def late(handle, how):
        if not opened:
            lock.unlink()
        opened.append(handle)
        flock(handle, how)

    monkeypatch.setattr(fcntl, "flock", late)
    with file_lock.file_lock(tmp_path / "out"):
        assert len(opened) == 2 and lock.exists()
    assert not lock.exists()


def test_the_lock_stands_inside_where_the_parent_is_read_only(tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()
    assert file_lock.lock_of(tmp_path / "out") == tmp_path / ".out.lock"
    monkeypatch.setattr(file_lock.os, "access", lambda path, mode: path != tmp_path)
    assert file_lock.lock_of(tmp_path / "out") == tmp_path / "out" / ".out.lock"
    assert file_lock.lock_of(tmp_path / "file") == tmp_path / ".file.lock"


def test_a_text_is_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "notes.txt"
    atomic_io.write_whole(path, "one")
    with pytest.raises(UnicodeEncodeError):
        atomic_io.write_whole(path, "two \ud800")
    assert path.read_text() == "one"
    atomic_io.write_whole(path, "two \u00e9")
    assert path.read_bytes() == "two \u00e9".encode()


def test_everything_in_a_folder_is_on_the_disk(tmp_path, monkeypatch):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "c.txt").write_text("c")
    settled, fsync = [], os.fsync
    monkeypatch.setattr(
        atomic_io.os, "fsync", lambda handle: settled.append(os.readlink(f"/proc/self/fd/{handle}")) or fsync(handle)
    )
    atomic_io.fsync_tree(tmp_path / "a")
    assert [one.removeprefix(f"{tmp_path}/") for one in settled] == ["a/b/c.txt", "a/b", "a"]


def test_what_was_there_stays_until_the_new_file_is_whole(tmp_path):
    """A disk that is full in the middle, as a limit of the size of files makes it; permissions and links stay."""
    kept, link = tmp_path / "kept.txt", tmp_path / "link.txt"
    kept.write_text("whole")
    kept.chmod(0o600)
    link.symlink_to(kept)
    with pytest.raises(OSError, match="full"), atomic_io.replacing(link) as file:
        file.write_text("ha")
        raise OSError("full")
    assert kept.read_text() == "whole" and sorted(one.name for one in tmp_path.iterdir()) == ["kept.txt", "link.txt"]
    with atomic_io.replacing(link) as file:
        assert file.suffix == ".txt" and file.parent == tmp_path
        file.write_text("new")
    assert link.is_symlink() and kept.read_text() == "new" and kept.stat().st_mode & 0o777 == 0o600


def test_a_new_file_has_the_permissions_that_the_user_wants(tmp_path):
    before = os.umask(0o077)
    try:
        with atomic_io.replacing(tmp_path / "a.txt") as file:
            file.write_text("a")
    finally:
        os.umask(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == 0o600


def test_it_is_on_the_disk_before_it_takes_the_place(tmp_path, monkeypatch):
    """A power cut leaves the old file or the new one: contents, then the name, then the folder."""
    steps, replace = [], os.replace
    monkeypatch.setattr(atomic_io, "sync", lambda path: steps.append(path.name))
    monkeypatch.setattr(atomic_io.os, "replace", lambda old, new: (steps.append("replace"), replace(old, new)))
    atomic_io.write_whole(tmp_path / "a.txt", "a")
    assert steps[0].startswith(".a.") and steps[1:] == ["replace", tmp_path.name]
