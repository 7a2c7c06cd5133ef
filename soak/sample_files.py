"""Valid binary files that hostile ones are made of: results of runs, logs of other programs, a campaign's store."""

import os
import struct
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from soak import specimens
from undertow.run import simulate_scenario
from undertow.scenario.yaml_text import load
from undertow.studies.campaign.run_campaign import STORE

Run = Callable[[Sequence[str]], int]


def material(run: Run) -> dict[str, bytes]:
    """Bytes of every file, by name: run.nc, run.mcap, run.csv, log.bin, log.ulg, log.bag, bag/..., store/...

    Args:
        run: `undertow` with arguments, in this process.
    """
    files = {"log.bin": _ardupilot(), "log.ulg": _px4()}
    before = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="undertow-soak-") as name:
        folder = Path(name)
        os.chdir(folder)
        try:
            result = simulate_scenario(load(specimens.SCENARIOS["axis"], "", "")[0])
            result.save("run.nc")
            for log in ("run.mcap", "run.csv"):
                result.log().save(Path(log))
            files |= {file_name: (folder / file_name).read_bytes() for file_name in ("run.nc", "run.mcap", "run.csv")}
            Path("c.yaml").write_text(specimens.CAMPAIGN, encoding="utf-8")
            if code := run(["campaign", "c.yaml", "--out", "out", "--workers", "1"]):
                raise RuntimeError(f"the campaign that stores are made of ended with exit code {code}")
            files |= {
                f"store/{file_name}": data for file_name, data in _files(folder / "out") if file_name.startswith(STORE)
            }
            if _bag(folder / "bag"):
                files |= {f"bag/{file_name}": data for file_name, data in _files(folder / "bag")}
        finally:
            os.chdir(before)
    return files


def _files(folder: Path) -> Iterator[tuple[str, bytes]]:
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            yield path.relative_to(folder).as_posix(), path.read_bytes()


def _ardupilot() -> bytes:
    """A .bin file of ArduPilot with attitudes and heights; its format is that of libraries/AP_Logger/LogStructure.h."""
    kinds = (
        (0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89),
        (0x82, "ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw", 23),
        (0x83, "BARO", "QBf", "TimeUS,I,Alt", 16),
    )
    out = b""
    for number, name, form, columns, size in kinds:
        packed = struct.pack("<BB4s16s64s", number, size, name.encode(), form.encode(), columns.encode())
        out += b"\xa3\x95\x80" + packed
    for i in range(30):
        out += b"\xa3\x95\x82" + struct.pack("<Qfff", 100_000 * i, i, -i, 3 * i)
        out += b"\xa3\x95\x83" + struct.pack("<QBf", 100_000 * i + 1, 0, -0.1 * i)
    return out


def _px4() -> bytes:
    """A .ulg file of PX4 with attitudes; its format is that of docs.px4.io/main/en/dev_log/ulog_file_format."""
    message = lambda kind, body: struct.pack("<HB", len(body), ord(kind)) + body
    out = b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    fields = b"vehicle_attitude:uint64_t timestamp;uint64_t timestamp_sample;float[4] q;float[4] delta_q_reset;"
    out += message("F", fields + b"uint8_t quat_reset_counter;")
    out += message("A", struct.pack("<BH", 0, 0) + b"vehicle_attitude")
    for i in range(30):
        row = struct.pack("<QQ8fB", 100_000 * i, 100_000 * i, 1, 0, 0, 0, 0, 0, 0, 0, 0)
        out += message("D", struct.pack("<H", 0) + row)
    return out


def _bag(folder: Path) -> bool:
    """Write a small bag of ROS 2; whether the package for it is there."""
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        return False
    store = get_typestore(Stores.LATEST)
    kind = "std_msgs/msg/Float64MultiArray"
    layout = store.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    import numpy as np

    with Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/thrusters", kind, typestore=store)
        for i in range(20):
            message = store.types[kind](layout, np.arange(6.0) + i)
            writer.write(connection, 100_000_000 * i, store.serialize_cdr(message, kind))
    return True


def _ros1_bag(path: Path) -> bytes:
    """A small bag of ROS 1, compressed, with positions."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "nav_msgs/msg/Odometry"
    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat.LZ4)
    writer.chunk_threshold = 2**12
    with writer:
        connection = writer.add_connection("/odom", kind, typestore=store)
        for i in range(20):
            header = struct.pack("<III", i, i, 0) + struct.pack("<I", 4) + b"odom" + struct.pack("<I", 0)
            pose = struct.pack("<7d", i, -i, 0.5 * i, 0, 0, 0, 1) + bytes(8 * 36)
            twist = struct.pack("<6d", 1, -1, 0.5, 0, 0, 0) + bytes(8 * 36)
            writer.write(connection, 10**9 * i, header + pose + twist)
    return path.read_bytes()
