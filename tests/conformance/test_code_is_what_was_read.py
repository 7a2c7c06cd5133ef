"""A part from a user's file is the text that was read: never byte code beside it, nor what the file held before."""

import importlib.util
import os
import py_compile
import sys

import pytest

from undertow.core.catalogue import find

TEXT = "def part():\n    return {!r}\n"


@pytest.fixture(autouse=True)
def byte_code(monkeypatch):
    """Python writes and reads compiled files, as it does by default."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)


def loaded(folder):
    return find("references", "mine.py:part", folder)()


def test_a_change_of_equal_size_within_a_second_is_seen(tmp_path):
    file = tmp_path / "mine.py"
    for value in ("first", "again", "third"):
        file.write_text(TEXT.format(value))
        os.utime(file, (1_700_000_000, 1_700_000_000))
        assert loaded(tmp_path) == value


def test_compiled_code_beside_a_file_does_not_run(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(TEXT.format("hidden"))
    unchecked = py_compile.PycInvalidationMode.UNCHECKED_HASH
    py_compile.compile(str(file), importlib.util.cache_from_source(str(file)), invalidation_mode=unchecked)
    file.write_text(TEXT.format("what is read"))
    assert loaded(tmp_path) == "what is read"


def test_another_encoding_is_understood(tmp_path):
    (tmp_path / "mine.py").write_bytes(b"# coding: latin-1\ndef part():\n    return '\xe9'\n")
    assert loaded(tmp_path) == "é"
