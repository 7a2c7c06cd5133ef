"""Entries of XLA's cache that were damaged after a process saw them are made again, and never run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from undertow.core.process_setup import remove_damaged


@pytest.fixture
def cache(tmp_path):
    for k in range(5):
        (tmp_path / f"jit_f{k}-cache").write_bytes(bytes([k]) * 1000)
    remove_damaged(tmp_path)
    return tmp_path


def entries(folder):
    return sorted(path.name for path in folder.iterdir() if path.name.endswith("-cache"))


def test_a_flipped_bit_and_a_lost_end_are_found(cache):
    before = entries(cache)
    remove_damaged(cache)
    assert entries(cache) == before and len(json.loads((cache / "checksums.json").read_text())) == 5
    (cache / "jit_f1-cache").write_bytes(b"\x01" * 500 + b"\x03" + b"\x01" * 499)
    (cache / "jit_f3-cache").write_bytes(b"\x03" * 999)
    remove_damaged(cache)
    assert entries(cache) == ["jit_f0-cache", "jit_f2-cache", "jit_f4-cache"]
    (cache / "jit_f1-cache").write_bytes(b"new")  # made again
    remove_damaged(cache)
    assert "jit_f1-cache" in entries(cache)


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b"\xff"])
def test_checksums_that_are_damaged_themselves_are_noted_again(cache, text):
    (cache / "checksums.json").write_bytes(text)
    remove_damaged(cache)
    assert len(entries(cache)) == len(json.loads((cache / "checksums.json").read_text())) == 5


def test_a_check_ends_in_time(cache):
    (cache / "jit_f0-cache").write_bytes(b"damaged")
    remove_damaged(cache, limit=-1.0)
    assert len(entries(cache)) == 5


PROGRAM = """
from undertow.core import process_setup
process_setup.prepare()
import jax, os
print(jax.jit(lambda x: jax.numpy.sin(x) @ x)(jax.numpy.arange(30.0)))
print(os.environ["JAX_COMPILATION_CACHE_DIR"])
"""


@pytest.mark.full
def test_jax_compiles_again_what_was_removed(tmp_path):
    """The entries have the names that are looked for, and all of them come back with the same result."""
    environment = {key: text for key, text in os.environ.items() if not key.startswith("JAX_")}
    environment["UNDERTOW_CACHE"] = str(tmp_path)

    def run():
        done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    result, folder = run()
    assert run() == [result, folder]  # the checksums are noted
    whole = {path: path.read_bytes() for path in Path(folder).glob("*-cache")}
    damaged = {path: data[:-40] + bytes([data[-40] ^ 1]) + data[-39:] for path, data in whole.items()}
    assert whole
    for path, data in damaged.items():
        path.write_bytes(data)
    assert run() == [result, folder]
    assert all(path.read_bytes() != data for path, data in damaged.items())
