"""Bags of ROS 1: types of their own, stamps, recordings that were killed, damage, and what no bag should hold."""

import bz2
import struct
import time
import tracemalloc

import lz4.frame
import numpy as np
import pytest
from other_programs import ros1_bag
from test_log_formats import ros_messages

from undertow.core.errors import BadInput
from undertow.logs.log import Log
from undertow.logs.mapping import mapping_of
from undertow.logs.read import read_log
from undertow.logs.ros_bag import read_ros_bag

START = 1_700_000_000 * 10**9
ARRAYS = {"input": {"topic": "/thrusters", "columns": ["data[0]..data[5]"], "unit": "us", "supply": 16}}
PULSES = np.random.default_rng(5).integers(1100, 1900, (300, 6))


def array_of(kind, values):
    """Bytes of a message of ROS 1 with a layout and an array."""
    return struct.pack("<III", 0, 0, len(values)) + np.asarray(values, dtype=kind).tobytes()


def thrusters():
    return [
        ("rovio/thrusters", "std_msgs/msg/UInt16MultiArray", START + k * 10**8, array_of("<u2", row))
        for k, row in enumerate(PULSES)
    ]


def bag_of(records, index=None):
    """Bytes of a bag of some records behind its header; whole, unless another place of the index is given."""
    index = 10**6 if index is None else index
    head = record({"op": b"\3", "index_pos": struct.pack("<Q", index), "conn_count": bytes(4), "chunk_count": bytes(4)})
    whole = b"#ROSBAG V2.0\n" + head + b"".join(records)
    return whole if index != 10**6 else bag_of(records, len(whole)) + record({"op": b"\4"})


def record(fields, data=b""):
    packed = [name.encode() + b"=" + value for name, value in fields.items()]
    head = b"".join(struct.pack("<I", len(field)) + field for field in packed)
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def chunk(compression, data, size):
    return record({"op": b"\5", "compression": compression, "size": struct.pack("<I", size)}, data)


def connection(kind, definition, number=0, topic=b"/x"):
    fields = {"type": kind, "md5sum": b"*", "message_definition": definition}
    return record({"op": b"\7", "conn": struct.pack("<I", number), "topic": topic}, record(fields)[4:-4])


def message(data, seconds, number=0):
    return record({"op": b"\2", "conn": struct.pack("<I", number), "time": struct.pack("<II", seconds, 0)}, data)


FLOATS = [connection(b"std_msgs/Float64", b"float64 data\n")] + [
    message(struct.pack("<d", k), k + 1) for k in range(50)
]
DEPTH = mapping_of({"signals": {"depth": {"topic": "/x", "columns": "data"}}})


def depths(path, data):
    path.write_bytes(data)
    log = read_log(path, DEPTH)
    return log["depth"].values.tolist(), log.notes


def test_arrays_by_index_and_relative_topics(tmp_path):
    """`rovio/thrusters` is /rovio/thrusters; `data[0]..data[5]` are the columns of an array, in any order."""
    ros1_bag(tmp_path / "a.bag", thrusters())
    columns = ["-data[5]", "data[0]..data[2]"]
    log = read_log(
        tmp_path / "a.bag", mapping_of({"signals": {"pulses": {"topic": "/rovio/thrusters", "columns": columns}}})
    )
    np.testing.assert_array_equal(log["pulses"].values, np.column_stack([3000 - PULSES[:, 5], PULSES[:, :3]]))
    np.testing.assert_allclose(log["pulses"].time, 0.1 * np.arange(300), atol=1e-9)
    with pytest.raises(BadInput, match=r"topic` must name one of the 1 topics .*Did you mean `/rovio/thrusters`"):
        read_log(tmp_path / "a.bag", mapping_of({"signals": {"pulses": {"topic": "rovio/thrusters", "columns": "x"}}}))


def test_types_of_a_bag_and_stamps(tmp_path):
    """A type that no other has, with a stamp, which goes before the time of recording."""
    definitions = {
        "rov_msgs/msg/Mixed": "Header header\nDuty[2] duties\nuint8 FULL=3\nstring name\n"
        + "=" * 80
        + "\nMSG: rov_msgs/Duty\nint16 permille\nfloat32[3] phases\n"
        + "=" * 80
        + "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    }
    rows = []
    for k in range(20):
        head = struct.pack("<III", k, 1_700_000_000 + k, 250_000_000) + struct.pack("<I", 2) + b"go"
        body = struct.pack("<h3f", k, 1, 2, k) + struct.pack("<h3f", -k, 3, 4, 0.5 * k)
        data = head + body + struct.pack("<I", 3) + b"abc"
        rows.append(("/mixed", "rov_msgs/msg/Mixed", START + k * 10**9 + 7 * 10**8, data))
    rows += [("/odd", "std_msgs/msg/Float64", START + k, b"no") for k in range(3)]
    ros1_bag(tmp_path / "a.bag", rows, definitions=definitions)
    columns = ["duties[0].permille", "duties[1].permille", "duties[1].phases[2]"]
    signals = {"thrust": {"topic": "/mixed", "columns": columns}}
    log = read_log(tmp_path / "a.bag", mapping_of({"signals": signals}))
    k = np.arange(20)
    np.testing.assert_array_equal(log["thrust"].values, np.column_stack([k, -k, 0.5 * k]))
    np.testing.assert_allclose(log["thrust"].time, k, atol=1e-9)
    assert len(log.notes) == 1 and log.notes[0].startswith("/odd is left out: messages of type std_msgs/msg/Float64")


def test_imu_is_read_without_a_mapping(tmp_path):
    """In forward, port, up of REP 103, which become forward, starboard, down."""
    rows = []
    for k in range(10):
        head = struct.pack("<III", k, 1_700_000_000 + k, 0) + struct.pack("<I", 3) + b"imu"
        turn, rates, force = (0.0, 0.0, 0.0, 1.0), (1.0, 2.0, 3.0 + k), (0.1, 0.2, 9.8)
        covariance = bytes(8 * 9)
        data = head + b"".join(struct.pack(f"<{len(v)}d", *v) + covariance for v in (turn, rates, force))
        rows.append(("/imu", "sensor_msgs/msg/Imu", START + k * 10**9, data))
    log = read_log(ros1_bag(tmp_path / "a.bag", rows))
    np.testing.assert_array_equal(log["angular_velocity"].values, [(1, -2, -3 - k) for k in range(10)])
    np.testing.assert_array_equal(log["specific_force"].values, [(0.1, -0.2, -9.8)] * 10)
    np.testing.assert_allclose(
        log["attitude"].values, [(0, 0, np.pi / 2)] * 10, atol=1e-12
    )  # east is a yaw of 90 degrees


@pytest.mark.full
@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_as_rosbags_reads_it(tmp_path, compression):
    """Every message of a bag, in order, by the reader of rosbags."""
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_typestore

    ros1_bag(tmp_path / "a.bag", [*thrusters(), *ros_messages()], compression, chunk_size=2**13)
    recording = read_ros_bag(tmp_path / "a.bag")
    assert recording.format == "ROS 1 bag" and not recording.notes
    store = get_typestore(Stores.ROS1_NOETIC)
    with Reader(tmp_path / "a.bag") as reader:
        messages = list(reader.messages())
    arrays = [store.deserialize_ros1(data, one.msgtype) for one, _, data in messages if "UInt16" in one.msgtype]
    table = recording.tables["/rovio/thrusters"]
    values = np.column_stack([table.fields[f"data[{i}]"] for i in range(6)])
    np.testing.assert_array_equal(values, [one.data for one in arrays])
    assert len(recording.tables["/odom"].time) == sum(one.topic == "/odom" for one, _, _ in messages) == 40


def test_a_recording_that_was_killed(tmp_path):
    """As rosbag leaves it: no index, and a last chunk of size 0, which ends within a message."""
    good = list(range(50))
    last = message(struct.pack("<d", 99), 99)
    records = [chunk(b"none", b"", 0), *FLOATS, last[: len(last) - 3]]
    found, notes = depths(tmp_path / "a.bag.active", bag_of(records, 0))
    assert found == good and notes == ("the recording was not ended, as after a crash: the bag has no index",)
    data = b"".join([*FLOATS, last])
    for name, packed in (("bz2", bz2.compress(data)), ("lz4", lz4.frame.compress(data, block_size=1 << 16))):
        first = chunk(name.encode(), packed, len(data))
        found, notes = depths(tmp_path / "a.bag", bag_of([first], 0))
        assert found == [*good, 99] and "the bag has no index" in notes[0]
        found, notes = depths(tmp_path / "a.bag", bag_of([first, chunk(name.encode(), b"", 0) + packed], 10**9))
        assert found == [*good, 99] and len(notes) == 2 and "the file ends early, after" in notes[0]


@pytest.mark.full
@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_bags_cut_at_any_byte(tmp_path, compression):
    """What was recorded before is read, message by message, with a note; a file without a message is one line."""
    mapping = mapping_of({"signals": {"pulses": {"topic": "/rovio/thrusters", "columns": ["data[0]..data[5]"]}}})
    whole = ros1_bag(tmp_path / "whole.bag", thrusters(), compression, chunk_size=2**12).read_bytes()
    path, before, refused = tmp_path / "a.bag", 0, 0
    places = np.linspace(0, len(whole) - 1, 200).astype(int)
    for place in places:
        path.write_bytes(whole[:place])
        try:
            log = read_log(path, mapping)
        except BadInput as error:
            refused += 1
            assert "a.bag" in str(error) and "\n" not in str(error) and before == 0
            continue
        rows = len(log["pulses"].time)
        assert rows >= before and (rows == 300 or log.notes == (f"the file ends early, after {place} bytes",))
        np.testing.assert_array_equal(log["pulses"].values, PULSES[:rows])
        before = rows
    assert before == 300 and refused < 100


@pytest.mark.full
def test_one_damaged_byte_costs_little(tmp_path):
    """Of 300 messages at most two are lost where chunks are not compressed, unless the type of all is damaged."""
    mapping = mapping_of({"signals": {"pulses": {"topic": "/rovio/thrusters", "columns": ["data[0]..data[5]"]}}})
    whole = ros1_bag(tmp_path / "whole.bag", thrusters()).read_bytes()
    path, chance = tmp_path / "a.bag", np.random.default_rng(3)
    messages = whole.index(b"op=\2") - 40  # behind the type of all of them
    noted = 0
    for place in chance.integers(messages, len(whole), 200):
        data = bytearray(whole)
        data[place] ^= int(chance.integers(1, 256))
        path.write_bytes(data)
        log = read_log(path, mapping)
        assert len(log["pulses"].time) >= 298
        noted += bool(log.notes)
    assert noted > 50


def test_a_damaged_chunk_costs_no_other(tmp_path):
    data = b"".join(FLOATS)
    packed = bz2.compress(data)
    later = b"".join(message(struct.pack("<d", k), k + 1) for k in range(50, 60))
    records = [*FLOATS[:1], chunk(b"bz2", packed[:40] + b"!!" + packed[42:], len(data)), chunk(b"bz2", bz2.compress(later), len(later))]  # fmt: skip
    found, notes = depths(tmp_path / "a.bag", bag_of(records))
    assert found == list(range(50, 60))
    assert len(notes) == 1 and notes[0].startswith(
        f"{len(packed)} bytes are damaged, and left out; the first at the chunk"
    )


def refused(path, data, said):
    """Check that a bag is refused within 10 s of the processor and 300 MB."""
    path.write_bytes(data)
    begin = time.process_time()
    tracemalloc.start()
    try:
        with pytest.raises(BadInput, match=said) as error:
            read_log(path, DEPTH)
        assert tracemalloc.get_traced_memory()[1] < 3e8
    finally:
        tracemalloc.stop()
    assert time.process_time() - begin < 10 and "\n" not in str(error.value)


@pytest.mark.full
@pytest.mark.parametrize("declared", [2**28, 100, 0])
@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_chunks_that_unpack_to_much(tmp_path, compression, declared):
    pack = bz2.compress if compression == "bz2" else lz4.frame.compress
    data = bag_of([chunk(compression.encode(), pack(bytes(2**28)), declared)])
    refused(
        tmp_path / "a.bag", data, r"a chunk of (268435456 bytes, more than the 67108864|more than the (100|0) bytes)"
    )


@pytest.mark.full
def test_many_chunks_that_unpack_to_much(tmp_path):
    packed = chunk(b"lz4", lz4.frame.compress(message(bytes(2**26 - 60), 1)), len(message(bytes(2**26 - 60), 1)))
    refused(tmp_path / "a.bag", bag_of([*FLOATS, *[packed] * 5]), "more than the 268435456 that are read of its size")


@pytest.mark.full
@pytest.mark.parametrize(
    "definition, data, said",
    [
        ("string[1000000000] x\n", b"", "it has 1000000000 fields, more than the 4096"),
        ("std_msgs/Empty[] x\n" + "=" * 80 + "\nMSG: std_msgs/Empty\n", b"\xff" * 4, "its x has a type without fields"),
        ("float64[] x\n", b"\xff" * 40, "cannot be decoded"),
        ("string[] x\n", b"\xff" * 40, "cannot be decoded"),
        ("A a\n", b"", "cannot be decoded .maximum recursion"),
    ],
)
def test_types_that_would_take_much(tmp_path, definition, data, said):
    refused(tmp_path / "a.bag", bag_of([connection(b"a/A", definition.encode()), message(data, 1)]), said)


@pytest.mark.full
def test_damage_that_looks_like_records_everywhere(tmp_path):
    refused(tmp_path / "a.bag", bag_of([struct.pack("<I", 200), b"\4\0\0\0op=\2" * 10**6]), r"bytes are damaged")


def test_what_is_no_bag_that_can_be_read(tmp_path):
    for data, said in (
        (b"#ROSBAG V1.2\n" + bytes(99), "must be a bag of ROS 1 in format 2.0, but is a.bag"),
        (b"", "must be a bag of ROS 1 in format 2.0, but is a.bag"),
        (bag_of([]), "must have messages that can be decoded, but is a.bag, which has none"),
        (bag_of([]).replace(b"chunk_count=" + bytes(4), b"encryptor=abcdef"), "a.bag, at its beginning: it is encrypted"),
        (bag_of([message(b"", 1)]), "1 messages are left out, whose connections the bag does not describe"),
    ):  # fmt: skip
        refused(tmp_path / "a.bag", data, said)


@pytest.mark.full
def test_conversion(tmp_path):
    """A converted bag has the numbers of the bag."""
    ros1_bag(tmp_path / "a.bag", ros_messages())
    log = read_log(tmp_path / "a.bag")
    assert isinstance(log, Log)
    log.save(tmp_path / "a.mcap")
    for name, series in read_log(tmp_path / "a.mcap").signals.items():
        np.testing.assert_array_equal(series.values, log[name].values)
