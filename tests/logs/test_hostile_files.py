"""Small files that would unpack to gigabytes or hold what makes no sense: one line, at once, in little memory."""

import struct
import time
import tracemalloc

import lz4.frame
import numpy as np
import pytest
import zstandard
from other_programs import ardupilot_bin, px4_ulg
from test_damage import a_log

import undertow as ut
from undertow.core.errors import BadInput
from undertow.logs import px4
from undertow.logs.mcap_writer import write_mcap
from undertow.logs.read import read_log
from undertow.scenario.build import build

pytestmark = pytest.mark.full

MAGIC = b"\x89MCAP0\r\n"
MUCH = 2**28  # bytes; few enough for a machine of a build to survive the old code


def record(kind, body):
    return struct.pack("<BQ", kind, len(body)) + body


def text(one):
    return struct.pack("<I", len(one)) + one


def mcap_of_chunk(compression, data, size):
    chunk = struct.pack("<QQQI", 0, 0, size, 0) + text(compression) + struct.pack("<Q", len(data)) + data
    return MAGIC + record(1, text(b"") * 2) + record(6, chunk) + record(15, bytes(4)) + MAGIC


def zstd(data):
    return zstandard.ZstdCompressor(level=1).compress(data)


def refused(path, said):
    """Check that a file is refused within 10 s of the processor and 300 MB."""
    start = time.process_time()
    tracemalloc.start()
    try:
        with pytest.raises(BadInput, match=said) as error:
            read_log(path)
        assert tracemalloc.get_traced_memory()[1] < 3e8
    finally:
        tracemalloc.stop()
    assert time.process_time() - start < 10 and "\n" not in str(error.value)


@pytest.mark.parametrize("declared", [MUCH, 100])
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_chunks_that_unpack_to_much(tmp_path, compression, declared):
    """Whether the file admits their size or not."""
    whole = record(0x80, bytes(MUCH - 9))
    data = zstd(whole) if compression == "zstd" else lz4.frame.compress(whole)
    (tmp_path / "a.mcap").write_bytes(mcap_of_chunk(compression.encode(), data, declared))
    refused(
        tmp_path / "a.mcap",
        r"but is a.mcap: at byte \d+: a chunk of (\d+ bytes, more than the 67108864|more than the 100 bytes)",
    )


@pytest.mark.parametrize("kind", [0, 0x80])
def test_chunks_of_empty_records(tmp_path, kind):
    data = bytes([kind, *bytes(8)]) * (2**24 // 9)
    (tmp_path / "a.mcap").write_bytes(mcap_of_chunk(b"zstd", zstd(data), len(data)))
    refused(tmp_path / "a.mcap", rf"at byte \d+: a record of kind {kind} in a chunk")


def test_zeros_where_a_record_should_be(tmp_path):
    """At the end, as after a failure of power, they are left out; elsewhere the file is damaged."""
    write_mcap(a_log(), tmp_path / "a.mcap")
    whole = (tmp_path / "a.mcap").read_bytes()
    data = whole[: whole.index(struct.pack("<BQ", 15, 4))]  # without the end
    (tmp_path / "a.mcap").write_bytes(data + bytes(10**6))
    log = read_log(tmp_path / "a.mcap")
    assert len(log["input"].time) == 50 and "ends early, within the record at byte" in log.notes[-1]
    (tmp_path / "a.mcap").write_bytes(data + bytes(900) + whole[len(data) :])
    refused(tmp_path / "a.mcap", rf"at byte {len(data)}: a record of kind 0")


def test_a_file_that_ends_before_its_first_message(tmp_path):
    write_mcap(a_log(), tmp_path / "a.mcap")
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "a.mcap").write_bytes(whole[:2000])
    refused(tmp_path / "a.mcap", r"which has none before it ends: .* within the record at byte \d+ of 2000")


def ulg_message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def test_arrays_of_arrays_in_a_format(tmp_path, monkeypatch):
    """200^3 numbers of one topic; and of many topics 6001 each, where fewer are read than 2^18, which take seconds."""
    nested = ("a:uint64_t timestamp;b[200] x;", "b:c[200] x;", "c:float[200] x;")
    body = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + bytes(8) + b"".join(ulg_message("F", one.encode()) for one in nested)
    (tmp_path / "a.ulg").write_bytes(body + ulg_message("A", struct.pack("<BH", 0, 0) + b"a"))
    refused(tmp_path / "a.ulg", r"a has 8000001 fields, .* 65535 of a topic")
    body = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + bytes(8) + ulg_message("F", b"a:uint64_t timestamp;float[6000] x;")
    several = b"".join(ulg_message("A", struct.pack("<BH", 0, i) + b"a") for i in range(400))
    (tmp_path / "a.ulg").write_bytes(body + several)
    assert px4._MOST_IN_ALL == 2**18
    monkeypatch.setattr(px4, "_MOST_IN_ALL", 2**14)
    refused(tmp_path / "a.ulg", r"a has 6001 fields, 18003 with those before; .* 16384 in all are read")
    (tmp_path / "a.ulg").write_bytes(px4_ulg([("a", 0, "uint64_t timestamp;float[3] x;", [(1, 1.0, 2.0, 3.0)])]))
    refused(tmp_path / "a.ulg", "none of the messages that are known")


def test_networks_that_unpack_to_much(tmp_path):
    model = build(
        {"plant": "inverted_pendulum", "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1}}
    ).closed_loop.plant.model()
    np.savez_compressed(tmp_path / "a.npz", weight_0=np.zeros((MUCH // 24, 3)), bias_0=np.zeros(1))
    with pytest.raises(BadInput, match=r"a.npz: its arrays have \d+ bytes, more than the 67108864 that are read"):
        ut.controllers.policy(model, str(tmp_path / "a.npz"))


def test_times_that_are_text(tmp_path):
    data = ardupilot_bin([("IMU", "QBf", "TimeUS,I,AccX", "s#o", [(1, 0, 1.0)])])
    old = struct.pack("<BB4s16s64s", 0x82, 16, b"IMU", b"QBf", b"TimeUS,I,AccX")
    new = struct.pack("<BB4s16s64s", 0x82, 12, b"IMU", b"nBf", b"TimeUS,I,AccX")
    assert old in data
    body = data.replace(old, new) + b"\xa3\x95\x82" + b"abcd" + struct.pack("<Bf", 0, 1.0)
    (tmp_path / "a.bin").write_bytes(body)
    refused(tmp_path / "a.bin", "have numbers as TimeUS, but is a.bin, whose messages IMU have text there")
