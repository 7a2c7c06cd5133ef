"""Bags of ROS 2 of which some topics cannot be decoded, and MCAP files whose messages all have other fields."""

import struct
import tracemalloc

import numpy as np
import pytest
from other_programs import json_mcap, ros2_bag
from test_hostile_files import mcap_of_chunk, record, zstd

from undertow.core.errors import BadInput
from undertow.logs import ros_bag as bag_reader
from undertow.logs.mapping import mapping_of
from undertow.logs.message_fields import MOST_FIELDS, MessageFields
from undertow.logs.read import read_log

START = 1_700_000_000 * 10**9
PULSES = {"input": {"topic": "/thrusters", "columns": ["data[0]", "data[1]"], "unit": "V"}}


def odometry(k):
    return {"position": (k, 0, 0), "quaternion": (1, 0, 0, 0), "linear": (0, 0, 0), "angular": (0, 0, 0)}


def messages():
    """41 messages of odometry, and 41 of thrusters 10 ms later."""
    for k in range(41):
        yield "/odom", "nav_msgs/msg/Odometry", START + k * 10**8, odometry(k)
        yield "/thrusters", "std_msgs/msg/Float64MultiArray", START + k * 10**8 + 10**7, {"data": [k, -k]}


def mcap(path, channels):
    """An MCAP file as ros2 bag writes them: topic -> (type, definition, [(ns, bytes), ...])."""
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        for topic, (kind, definition, several) in channels.items():
            schema = writer.register_schema(kind, "ros2msg", definition.encode())
            channel = writer.register_channel(topic, "cdr", schema)
            for ns, data in several:
                writer.add_message(channel, ns, data, ns)
        writer.finish()


def stored(folder):
    """The good messages as they are stored: topic -> (type, definition, [(ns, bytes), ...])."""
    from rosbags.rosbag2 import Reader

    ros2_bag(folder, "mcap", list(messages()))
    channels = {}
    with Reader(folder) as reader:
        for connection, ns, data in reader.messages(reader.connections):
            entry = (connection.msgtype, connection.msgdef.data, [])
            channels.setdefault(connection.topic, entry)[2].append((ns, bytes(data)))
    return channels


@pytest.fixture(scope="module")
def channels(tmp_path_factory):
    return stored(tmp_path_factory.mktemp("good") / "bag")


EVENTS = "int64 a\nint64 b\n---\nint64 sum\n"
BROKEN = {
    "/rosout": (
        "rcl_interfaces/msg/Log",
        "uint32 level\nstring name\nfloat64[4] x\n",
        [(START, b"\0\1\0\0" + bytes(9))],
    ),
    "/add/_service_event": ("example_interfaces/srv/AddTwoInts_Event", EVENTS, [(START + 5, b"\0\1\0\0" + bytes(12))]),
}


def test_topics_that_cannot_be_decoded_cost_no_other(tmp_path, channels):
    """An old /rosout and service events beside odometry: everything else is read, and the notes say what is not."""
    mcap(tmp_path / "a.mcap", {**BROKEN, **channels})
    log = read_log(tmp_path / "a.mcap", mapping_of({"signals": PULSES}))
    np.testing.assert_array_equal(log["position"].values[:, 1], np.arange(41))  # x is east
    np.testing.assert_allclose(log["position"].time, 0.1 * np.arange(41), atol=1e-9)
    np.testing.assert_array_equal(log["input"].values, np.outer(np.arange(41), [1, -1]))
    rosout, events = log.notes
    assert rosout.startswith("/rosout is left out: messages of type rcl_interfaces/msg/Log cannot be decoded (")
    assert events.startswith("/add/_service_event is left out: the definition of its type example_interfaces/srv/Add")
    with pytest.raises(
        BadInput, match=r"topic` must name messages that can be read, but is /rosout of a.mcap: messages"
    ):
        read_log(tmp_path / "a.mcap", mapping_of({"signals": {"depth": {"topic": "/rosout", "columns": "x"}}}))


def test_some_messages_of_a_topic_cannot_be_decoded(tmp_path, channels):
    kind, definition, several = channels["/odom"]
    damaged = [(ns, data[:50] if k in (3, 7) else data) for k, (ns, data) in enumerate(several)]
    mcap(tmp_path / "a.mcap", {"/odom": (kind, definition, damaged)})
    log = read_log(tmp_path / "a.mcap")
    np.testing.assert_array_equal(log["position"].values[:, 1], np.delete(np.arange(41), [3, 7]))
    assert log.notes[0].startswith(
        "2 messages of /odom are left out, the first because messages of type nav_msgs/msg/Odo"
    )


def test_only_what_is_requested_is_decoded(tmp_path, channels, monkeypatch):
    """Of other topics the first message, so that an error can list their columns."""
    seen = []

    class Counting(bag_reader.Decoder):
        def decoded(self, data, kind, definition):
            seen.append(kind)
            return super().decoded(data, kind, definition)

    monkeypatch.setattr(bag_reader, "Decoder", Counting)
    mcap(tmp_path / "a.mcap", channels)
    read_log(tmp_path / "a.mcap")
    assert seen.count("nav_msgs/msg/Odometry") == 41 and seen.count("std_msgs/msg/Float64MultiArray") == 1
    only = {topic: channel for topic, channel in channels.items() if topic == "/thrusters"}
    mcap(tmp_path / "b.mcap", only)
    with pytest.raises(BadInput, match=r"It has /thrusters \(layout.data_offset, data\[0\], data\[1\]\)"):
        read_log(tmp_path / "b.mcap")
    assert "input" in read_log(tmp_path / "b.mcap", mapping_of({"signals": {"input": {"columns": ["data[0]"]}}}))


def test_topics_of_text_have_no_numbers(tmp_path):
    texts = [(START + k, b"\0\1\0\0" + struct.pack("<I", 6) + b"hello\0") for k in range(3)]
    mcap(tmp_path / "a.mcap", {"/chatter": ("std_msgs/msg/String", "string data\n", texts)})
    with pytest.raises(BadInput, match=r"It has /chatter \(no numbers\)$"):
        read_log(tmp_path / "a.mcap")


def test_a_bag_that_ends_early(tmp_path, channels):
    """After `kill -9` an MCAP file has no end: what is whole is read, with a note."""
    mcap(tmp_path / "a.mcap", channels)
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "a.mcap").write_bytes(whole[: whole.index(struct.pack("<BQ", 15, 4))] + record(6, bytes(99))[:40])
    log = read_log(tmp_path / "a.mcap")
    assert len(log["position"].time) == 41 and "the file ends early" in log.notes[-1]


@pytest.mark.full
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_compressed_files_and_messages(tmp_path, storage):
    """Of `ros2 bag record --compression-mode file`, and `message`: unpacked, but not to any size."""
    ros2_bag(tmp_path / "bag", storage, list(messages()))
    expected = read_log(tmp_path / "bag")
    file = next(one for one in (tmp_path / "bag").iterdir() if one.suffix in (".mcap", ".db3"))
    (tmp_path / "bag" / f"{file.name}.zstd").write_bytes(zstd(file.read_bytes()))
    file.unlink()
    log = read_log(tmp_path / "bag")
    np.testing.assert_array_equal(log["position"].values, expected["position"].values)
    (tmp_path / "bag" / f"{file.name}.zstd").write_bytes(zstd(bytes(2**28 + 1)))
    with pytest.raises(BadInput, match=r"bag, at its beginning: .*zstd unpacks to more than the 268435456 bytes"):
        read_log(tmp_path / "bag")


@pytest.mark.full
def test_compressed_messages(tmp_path, channels):
    kind, definition, several = channels["/odom"]
    packed = [(ns, zstd(data)) for ns, data in several]
    packed[5] = (packed[5][0], zstd(bytes(2**26 + 1)))
    mcap(tmp_path / "a.mcap", {"/odom": (kind, definition, packed[:5])})
    assert len(read_log(tmp_path / "a.mcap")["position"].time) == 5
    mcap(tmp_path / "a.mcap", {"/odom": (kind, definition, packed)})
    with pytest.raises(BadInput, match="a message of more than the 67108864 bytes that are read"):
        read_log(tmp_path / "a.mcap")


def ros2_of_chunks(several):
    """A bag with a good first chunk, and others that are given packed, with their declared size."""
    text = lambda one: struct.pack("<I", len(one)) + one
    kind = b"std_msgs/msg/Float64"
    schema = record(3, struct.pack("<H", 1) + text(kind) + text(b"ros2msg") + text(b"float64 data\n"))
    channel = record(4, struct.pack("<HH", 1, 1) + text(b"/x") + text(b"cdr") + text(b""))
    message = record(5, struct.pack("<HIQQ", 1, 0, START, START) + b"\0\1\0\0" + struct.pack("<d", 2.5))
    whole = mcap_of_chunk(b"", schema + channel + message, len(schema + channel + message))
    magic, head = whole[:8], record(1, text(b"ros2") + text(b""))
    end = whole[whole.index(record(15, bytes(4))) :]
    first = whole[len(magic) + 17 : len(whole) - len(end)]
    chunks = b""
    for data, size in several:
        body = struct.pack("<QQQI", 0, 0, size, 0) + text(b"zstd") + struct.pack("<Q", len(data)) + data
        chunks += record(6, body)
    return magic + head + first + chunks + end


@pytest.mark.full
@pytest.mark.parametrize("declared", [2**28, 100])
def test_no_chunk_unpacks_freely(tmp_path, declared):
    """Nor one after the first channel, whether it admits its size or not; nor many that are small each."""
    (tmp_path / "a.mcap").write_bytes(ros2_of_chunks([]))
    assert "input" in read_log(tmp_path / "a.mcap", mapping_of({"signals": {"input": {"columns": ["data"]}}}))
    (tmp_path / "a.mcap").write_bytes(ros2_of_chunks([(zstd(record(5, bytes(2**28))), declared)]))
    tracemalloc.start()
    with pytest.raises(
        BadInput, match=r"a.mcap: at byte \d+: a chunk of (\d+ bytes, more than the 67108864|more than the 100 bytes)"
    ):
        read_log(tmp_path / "a.mcap")
    assert tracemalloc.get_traced_memory()[1] < 2e8
    tracemalloc.stop()


@pytest.mark.full
def test_the_sum_of_the_chunks_is_bounded(tmp_path):
    """Ten of 48 MB from a file of some kB."""
    whole = record(5, struct.pack("<HIQQ", 1, 0, START, START) + bytes(48 * 2**20))
    (tmp_path / "a.mcap").write_bytes(ros2_of_chunks([(zstd(whole), len(whole))] * 10))
    with pytest.raises(BadInput, match=r"chunks of \d+ bytes in all, more than the 268435456 that are read of a file"):
        read_log(tmp_path / "a.mcap")


@pytest.mark.full
def test_messages_with_a_field_of_their_own_each(tmp_path):
    """Twice as many take about twice the memory, not four times; a column is there when it is asked for."""
    sizes = []
    for number in (3000, 6000):
        json_mcap(tmp_path / "a.mcap", {"/p": [(k * 10**6, {f"x{k}": k, "y": 2.5}) for k in range(number)]})
        mapping = mapping_of({"signals": {"depth": {"topic": "/p", "columns": "y"}}})
        read_log(tmp_path / "a.mcap", mapping)
        tracemalloc.start()
        log = read_log(tmp_path / "a.mcap", mapping)
        sizes.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert len(log["depth"].values) == number
    assert sizes[1] < 2.6 * sizes[0] and sizes[1] < 2e7
    mapping = mapping_of({"signals": {"depth": {"topic": "/p", "columns": "x7"}}})
    values = read_log(tmp_path / "a.mcap", mapping)["depth"].values
    assert values[7] == 7 and np.isnan(np.delete(values, 7)).all()


def test_too_many_fields():
    fields = MessageFields("a")
    with pytest.raises(ValueError, match="more than 65535 different fields"):
        fields.add(0, 0, ((f"x{i}", 0.0) for i in range(MOST_FIELDS + 1)))


@pytest.mark.full
def test_a_topic_with_too_many_fields_costs_no_other(tmp_path):
    many = [(0, {f"x{i}": 1 for i in range(MOST_FIELDS + 1)})]
    json_mcap(
        tmp_path / "a.mcap", {"/many": many, "/p": [(0, {"y": 2}), (10**9, {"y": 3})], "/q": [(0, {"y": 10**400})]}
    )
    log = read_log(tmp_path / "a.mcap", mapping_of({"signals": {"depth": {"topic": "/p", "columns": "y"}}}))
    np.testing.assert_array_equal(log["depth"].values, [2, 3])
    assert log.notes[0] == "/many is left out: its messages have more than 65535 different fields"
    assert log.notes[1].startswith("/q is left out: ")
