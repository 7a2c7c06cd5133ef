"""Files are written by one process at a time, whole, and are on the disk."""

import fcntl
import os

import pytest

from undertow.core import disk


def test_one_at_a_time_in_either_of_two_names(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "out", target_is_directory=True)
    with disk.alone(tmp_path / "out"):
        for path in (tmp_path / "out", tmp_path / "link"):
            with (
                pytest.raises(disk.InUse, match=r"^`--out` must be a folder that nothing else writes to"),
                disk.alone(path),
            ):
                pass
        with disk.alone(tmp_path / "another"):
            pass
    with disk.alone(tmp_path / "out"):
        pass
    assert [one.name for one in tmp_path.iterdir()] == ["link"]


def test_the_lock_is_released_by_an_error(tmp_path):
    with pytest.raises(ZeroDivisionError), disk.alone(tmp_path / "out"):
        raise ZeroDivisionError
    with disk.alone(tmp_path / "out"):
        pass


def test_a_lock_whose_file_was_removed_meanwhile_is_taken_again(tmp_path, monkeypatch):
    """Between opening and locking, its owner ends and removes it."""
    lock, flock, opened = disk.lock_of(tmp_path / "out"), fcntl.flock, []

    def late(handle, how):
        if not opened:
            lock.unlink()
        opened.append(handle)
        flock(handle, how)

    monkeypatch.setattr(disk.fcntl, "flock", late)
    with disk.alone(tmp_path / "out"):
        assert len(opened) == 2 and lock.exists()
    assert not lock.exists()


def test_the_lock_stands_inside_where_the_parent_is_read_only(tmp_path, monkeypatch):
    (tmp_path / "out").mkdir()
    assert disk.lock_of(tmp_path / "out") == tmp_path / ".out.lock"
    monkeypatch.setattr(disk.os, "access", lambda path, mode: path != tmp_path)
    assert disk.lock_of(tmp_path / "out") == tmp_path / "out" / ".out.lock"
    assert disk.lock_of(tmp_path / "file") == tmp_path / ".file.lock"


def test_a_text_is_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "notes.txt"
    disk.write_whole(path, "one")
    with pytest.raises(UnicodeEncodeError):
        disk.write_whole(path, "two \ud800")
    assert path.read_text() == "one"
    disk.write_whole(path, "two \u00e9")
    assert path.read_bytes() == "two \u00e9".encode()


def test_everything_in_a_folder_is_on_the_disk(tmp_path, monkeypatch):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "c.txt").write_text("c")
    settled, fsync = [], os.fsync
    monkeypatch.setattr(
        disk.os, "fsync", lambda handle: settled.append(os.readlink(f"/proc/self/fd/{handle}")) or fsync(handle)
    )
    disk.settle(tmp_path / "a")
    assert [one.removeprefix(f"{tmp_path}/") for one in settled] == ["a/b/c.txt", "a/b", "a"]
