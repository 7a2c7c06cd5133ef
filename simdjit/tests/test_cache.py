"""The cache of compiled code under attack: what is damaged or somebody else's is made again, and never run."""

import os
import subprocess
import sys

import numpy as np
import pytest

from simdjit import cache, cpu

pytestmark = pytest.mark.compiler

CODE = b"compiled " * 1000


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("SIMDJIT_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def made():
    """How often something was made."""
    return []


def keep(made, program="a program", code=CODE):
    return cache.cached(program, ".o", lambda: made.append(program) or code)


def entry(folder):
    (path,) = folder.rglob("*.o")
    return path


def test_made_once_for_the_user_alone(folder, made):
    old = os.umask(0o002)
    try:
        assert [keep(made), keep(made)] == [CODE, CODE] and len(made) == 1
    finally:
        os.umask(old)
    assert entry(folder).stat().st_mode & 0o077 == 0 and entry(folder).parent.stat().st_mode & 0o077 == 0
    assert [path.name for path in entry(folder).parent.iterdir()] == [entry(folder).name], "nothing is left over"


def flipped(data, place):
    return data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :]


DAMAGES = {
    "truncated": lambda data: data[: len(data) // 2],
    "empty": lambda data: b"",
    "digest_only": lambda data: data[:32],
    "first_bit": lambda data: flipped(data, 0),
    "bit_in_the_middle": lambda data: flipped(data, 4000),
    "last_bit": lambda data: flipped(data, len(data) - 1),
    "longer": lambda data: data + b"\0",
    "foreign": lambda data: b"\x7fELF of somebody" * 100,
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_entry_is_made_again(folder, made, name):
    keep(made)
    path = entry(folder)
    sound = path.read_bytes()
    path.write_bytes(DAMAGES[name](sound))
    assert keep(made) == CODE and len(made) == 2
    assert path.read_bytes() == sound
    assert keep(made) == CODE and len(made) == 2


def test_an_entry_under_the_name_of_another_is_made_again(folder, made):
    keep(made, "another", b"another")
    other = entry(folder)
    stolen = other.read_bytes()
    other.unlink()
    keep(made)
    entry(folder).write_bytes(stolen)
    assert keep(made) == CODE and made == ["another", "a program", "a program"]


@pytest.mark.parametrize("mode", [0o622, 0o660])
def test_an_entry_that_others_may_write_is_made_again(folder, made, mode):
    keep(made)
    entry(folder).chmod(mode)
    assert keep(made) == CODE and len(made) == 2
    assert entry(folder).stat().st_mode & 0o777 == 0o600


def test_a_link_is_not_followed(folder, made, tmp_path):
    keep(made)
    path, target = entry(folder), tmp_path / "elsewhere.o"
    path.rename(target)
    path.symlink_to(target)
    before = target.read_bytes()
    assert keep(made) == CODE and len(made) == 2
    assert not path.is_symlink() and target.read_bytes() == before


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o1777])
def test_a_folder_that_others_may_write_is_no_cache(folder, made, mode):
    keep(made)
    entry(folder).parent.chmod(mode)
    keep(made)
    assert len(made) == 2


def test_a_folder_that_is_a_link_is_no_cache(folder, made, tmp_path):
    (tmp_path / "theirs").mkdir(mode=0o700)
    folder.symlink_to(tmp_path / "theirs")
    assert [keep(made), keep(made)] == [CODE, CODE] and len(made) == 2
    assert not list((tmp_path / "theirs").iterdir())


@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_belongs_to_somebody_else_is_not_used(folder, made, monkeypatch, what):
    keep(made)
    somebody = os.geteuid() + 1
    place = "fstat" if what == "file" else "lstat"
    honest = getattr(os, place)

    def stat(*arguments):
        found = list(honest(*arguments))
        found[4] = somebody
        return os.stat_result(found)

    monkeypatch.setattr(os, place, stat)
    assert keep(made) == CODE and len(made) == 2


def test_what_cannot_be_written_is_made_every_time(made, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("SIMDJIT_CACHE", str(tmp_path / "file"))
    assert [keep(made), keep(made)] == [CODE, CODE] and len(made) == 2


def test_an_entry_is_on_the_disk_before_it_has_its_name(folder, made, monkeypatch):
    done = []
    sync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda handle: done.append("sync") or sync(handle))
    monkeypatch.setattr(os, "replace", lambda *names: done.append("name") or replace(*names))
    keep(made)
    assert done == ["sync", "name"]


def test_a_write_that_fails_leaves_nothing(folder, made, monkeypatch):
    def full(handle):
        raise OSError("no space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert keep(made) == CODE
    assert not list(folder.iterdir())


WRITER = """
import sys
from simdjit import cache
code = sys.argv[1].encode() * 100_000
for i in range(40):
    for path in cache.default_folder().glob("*.o"):
        if i % 4 == 0:
            path.unlink(missing_ok=True)
    assert cache.cached("shared", ".o", lambda: code) in (b"a" * 100_000, b"b" * 100_000)
"""


def test_two_processes_at_once(folder):
    several = [subprocess.Popen([sys.executable, "-c", WRITER, letter]) for letter in "ab"]
    assert [one.wait() for one in several] == [0, 0]
    assert [path.suffix for path in folder.iterdir()] == [".o"]


def test_machine_code_that_was_truncated_is_compiled_again(folder):
    """Without the checksum, LLVM ends the process on such a file."""
    assembly = """
define void @run(ptr noalias %numbers, ptr noalias %carry, ptr noalias %series, i64 %steps, i64 %every) {
  store double 7.0, ptr %carry
  ret void
}"""
    memory = [np.zeros((1, 8)) for _ in range(3)]
    for keep_bytes in (None, 500):
        if keep_bytes:
            entry(folder).write_bytes(entry(folder).read_bytes()[:keep_bytes])
        memory[1][:] = 0.0
        cpu.Code(assembly).run(*memory, 1, 0)
        assert memory[1][0, 0] == 7.0
