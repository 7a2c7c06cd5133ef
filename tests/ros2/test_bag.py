"""rosbag2 of either storage: a run comes back in our axes, rosbags itself reads it, damage is one line."""

import sqlite3
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.numerics.rotations import quaternion_from_euler
from undertow.logs.background_writer import BackgroundWriter
from undertow.logs.mapping import mapping_of
from undertow.logs.read import read_log
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2 import read_rosbag2, to_messages
from undertow.outside.ros2.from_messages import Frames
from undertow.outside.ros2.link import Link
from undertow.outside.ros2.write_bag import STORAGES, BagWriter, write_rosbag2

pytestmark = pytest.mark.interop

STILL = {
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "shaft", "supply": 24}},
    "controller": {"kind": "pid", "frequency": 1.0},
    "reference": {"kind": "setpoint", "position": [1, 0.5, 0.3, 0, 0, 0.4], "settling": 2},
    "navigation": {"kind": "white_noise", "position": 0.001, "velocity": 0.01},
    "loop": {"duration": 1.0, "dt": 0.01, "record": 0.01},
}


@pytest.fixture(scope="module")
def run():
    return ut.simulate_scenario(STILL)


@pytest.mark.parametrize("storage", STORAGES)
def test_a_run_comes_back(run, tmp_path, storage):
    record = run.dataset
    write_rosbag2(run, tmp_path / "bag", storage)
    found = read_rosbag2(tmp_path / "bag")
    for topic, name in (("/odom", "measured_position"), ("/ground_truth", "position")):
        times, position = found[f"{topic}/position"]
        np.testing.assert_allclose(times, record["time"].values, atol=1e-9)
        np.testing.assert_array_equal(position, record[name].values[:, :3])
        angles = record[name].values[:, 3:]
        expected = np.array([quaternion_from_euler(one) for one in angles])
        np.testing.assert_allclose(found[f"{topic}/quaternion"][1], expected, atol=1e-15)
    np.testing.assert_array_equal(found["/thrusters"][1], record["input"].values)
    np.testing.assert_allclose(found["/target_pose/pose"][1], record["reference"].values, atol=1e-14)
    final = run.outcome.final[0]
    np.testing.assert_allclose(found["/ground_truth/velocity"][1][-1], final.nu, atol=1e-14)


def test_a_run_file_is_written_too(run, tmp_path):
    run.save(tmp_path / "run.nc")
    write_rosbag2(tmp_path / "run.nc", tmp_path / "bag")
    np.testing.assert_array_equal(read_rosbag2(tmp_path / "bag")["/thrusters"][1], run.dataset["input"].values)


def test_a_damaged_run_file_is_refused(tmp_path):
    (tmp_path / "run.nc").write_bytes(b"CDF\x01" + bytes(20))  # whole, with nothing in it
    with pytest.raises(BadInput, match="`run` must be of a vehicle"):
        write_rosbag2(tmp_path / "run.nc", tmp_path / "bag")
    (tmp_path / "run.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(20))
    with pytest.raises(BadInput, match=r"`run` must be the run.nc of a run, but is run.nc, which is damaged"):
        write_rosbag2(tmp_path / "run.nc", tmp_path / "bag")
    assert not (tmp_path / "bag").exists()


def test_rosbags_reads_what_was_written(run, tmp_path):
    """By the standard names and definitions that are in the bag, not by this package."""
    write_rosbag2(run, tmp_path / "bag")
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Reader(tmp_path / "bag") as reader:
        kinds = {one.topic: one.msgtype for one in reader.connections}
        first = next(
            store.deserialize_cdr(data, one.msgtype) for one, _, data in reader.messages() if one.topic == "/odom"
        )
    assert kinds["/odom"] == "nav_msgs/msg/Odometry" and kinds["/clock"] == "rosgraph_msgs/msg/Clock"
    position = run.dataset["measured_position"].values[0]
    assert (first.pose.pose.position.x, first.pose.pose.position.z) == (position[1], -position[2])
    assert (first.header.frame_id, first.child_frame_id) == ("odom", "base_link")


def test_a_topic_in_another_frame_is_left_out(tmp_path):
    with BagWriter(tmp_path / "bag") as bag:
        for name, frame in (("/good", "map"), ("/wrong", "world_ned")):
            bag.write((name, ros.PoseStamped(ros.Header(ros.Time(), frame)), 1_000_000_000))
    said = r"Left out: 1 messages of /wrong. The first: `/wrong header.frame_id` must be .*, but is 'world_ned'"
    with pytest.warns(UserWarning, match=said):
        found = read_rosbag2(tmp_path / "bag")
    assert found.keys() == {"/good/pose"} and found["/good/pose"][0].tolist() == [1.0]
    assert read_rosbag2(tmp_path / "bag", frames=Frames(("map", "world_ned"))).keys() == {"/good/pose", "/wrong/pose"}


def test_a_message_that_cannot_be_used_costs_no_other(tmp_path):
    with BagWriter(tmp_path / "bag") as bag:
        for x in (1.0, np.nan, 3.0):
            bag.write(("/t", ros.PoseStamped(ros.Header(ros.Time(), "map"), ros.PoseMessage(ros.Point(x))), 10**9))
    with pytest.warns(UserWarning, match="Left out: 1 messages of /t"):
        assert read_rosbag2(tmp_path / "bag")["/t/pose"][1][:, 1].tolist() == [1.0, 3.0]


def test_topics_are_chosen(run, tmp_path):
    write_rosbag2(run, tmp_path / "bag")
    assert read_rosbag2(tmp_path / "bag", ["/thrusters"]).keys() == {"/thrusters"}
    with pytest.raises(BadInput, match="must have messages that can be used of /nothing"):
        read_rosbag2(tmp_path / "bag", ["/nothing"])


def test_wrenches_and_imu_readings_are_read(tmp_path):
    frames, stamp = Frames(), ros.Time(1, 0)
    with BagWriter(tmp_path / "bag") as bag:
        bag.write(("/wrench", to_messages.wrench_of(np.arange(6.0), stamp, frames), 10**9))
        bag.write(("/imu", ros.Imu(linear_acceleration=ros.Vector3(1.0, 2.0, 9.81)), 10**9))
    found = read_rosbag2(tmp_path / "bag")
    np.testing.assert_array_equal(found["/wrench/wrench"][1], [np.arange(6.0)])
    np.testing.assert_array_equal(found["/imu/specific_force"][1], [[1.0, -2.0, -9.81]])


def test_a_bag_is_complete_after_an_exception(tmp_path):
    with pytest.raises(KeyboardInterrupt), BagWriter(tmp_path / "bag") as bag:
        bag.write(("/t", ros.Float64MultiArray(data=[1.0]), 10**9))
        raise KeyboardInterrupt
    assert read_rosbag2(tmp_path / "bag")["/t"][1].tolist() == [[1.0]]


def test_what_is_no_bag(run, tmp_path):
    with pytest.raises(BadInput, match=r"`log` must be a bag of ROS 2, with files \.mcap, \.db3"):
        read_rosbag2(tmp_path)
    with pytest.raises(BadInput, match="must be a new folder, but is there already"):
        write_rosbag2(run, tmp_path)
    with pytest.raises(BadInput, match="`storage` must be one of mcap, sqlite3"):
        write_rosbag2(run, tmp_path / "bag", "db3")
    with BagWriter(tmp_path / "odd") as bag:
        for data in ([1.0], [1.0, 2.0]):
            bag.write(("/t", ros.Float64MultiArray(data=data), 10**9))
    with pytest.raises(BadInput, match="`/t` must have arrays of one length, but is 1, 2 long"):
        read_rosbag2(tmp_path / "odd")


def test_a_run_of_something_else(tmp_path):
    pendulum = {
        "plant": "inverted_pendulum",
        "reference": {"kind": "setpoint", "position": [0]},
        "loop": {"duration": 0.1},
    }
    with pytest.raises(BadInput, match="`run` must be of a vehicle"):
        write_rosbag2(ut.simulate_scenario(pendulum), tmp_path / "bag")
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize("storage", STORAGES)
def test_damaged_bags_are_one_line(run, tmp_path, storage):
    """Seeded mutations and truncations of the data and of metadata.yaml."""
    short = run.dataset.isel(time=slice(0, 3))
    write_rosbag2(short, tmp_path / "bag", storage)
    files = sorted((tmp_path / "bag").iterdir())
    whole, chance, refused = {path: path.read_bytes() for path in files}, np.random.default_rng(4), 0
    for _ in range(150):
        path = files[chance.integers(len(files))]
        data = bytearray(whole[path])
        for place in chance.integers(0, len(data), 1 + chance.integers(8)):
            data[place] = chance.integers(256)
        path.write_bytes(data[: chance.integers(len(data))] if chance.random() < 0.4 else data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read_rosbag2(tmp_path / "bag")
        except (BadInput, OSError) as error:
            refused += 1
            assert "\n" not in str(error)
        path.write_bytes(whole[path])
    assert refused > 30
    assert read_rosbag2(tmp_path / "bag")["/thrusters"][1].shape == (3, 8)


class Stuck:
    """A recorder whose disk does not answer until it is let go, or fails."""

    def __init__(self, error=None):
        self.error, self.go, self.written, self.threads = error, threading.Event(), [], set()

    def write(self, entry):
        self.threads.add(threading.current_thread())
        if self.error is not None:
            raise self.error
        self.go.wait()
        self.written.append(entry)

    def flush(self):
        pass

    def close(self, dropped):
        self.written.append(dropped)

    def abandon(self):
        self.written.append("abandoned")


STILL_POSE = ros.PoseStamped(ros.Header(ros.Time(), "map"))


@pytest.mark.parametrize("error", [OSError("No space left on device"), sqlite3.OperationalError("disk is full")])
def test_a_full_disk_ends_the_bag_and_not_the_node(domain, error):
    disk, troubles = Stuck(error), []
    bag = BackgroundWriter(lambda: disk)
    with Link(domain, localhost=True, bag=bag) as link:
        link.on_trouble = lambda *trouble: troubles.append(trouble)
        link.record("/t", STILL_POSE)
        bag.close()
        for _ in range(3):
            link.record("/t", STILL_POSE)
    assert disk.written == ["abandoned"] and troubles == [("bag ended", f"the bag cannot be written any more: {error}")]
    assert bag.missing("messages") == [f"{error}; later messages are not recorded"]


def test_a_disk_that_blocks_holds_up_no_message(domain):
    """The node goes on; what finds no place is counted, and the bag says so."""
    disk, troubles = Stuck(), []
    bag = BackgroundWriter(lambda: disk, capacity=10)
    with Link(domain, localhost=True, bag=bag) as link:
        link.on_trouble = lambda *trouble: troubles.append(trouble)
        for _ in range(30):
            link.record("/t", STILL_POSE)
        assert disk.written == [] and 19 <= len(troubles) <= 20
        assert troubles[0] == ("not recorded", "the disk is too slow: messages are missing in the bag")
        disk.go.set()
    bag.close()
    dropped = len(troubles)
    assert len(disk.written) == 31 - dropped and disk.written[-1] == dropped
    assert threading.current_thread() not in disk.threads
    assert bag.missing("messages") == [f"{dropped} messages are missing: the disk was too slow"]


RECORDED = """
import sys, time
from undertow.outside.ros2 import messages as ros
from undertow.outside.ros2.write_bag import BagWriter
from undertow.logs.background_writer import BackgroundWriter

bag = BackgroundWriter(BagWriter(__import__("pathlib").Path(sys.argv[1]), sys.argv[2]).open)
for k in range(10**6):
    bag.put(("/late" if k > 100 else "/t", ros.Float64MultiArray(data=[float(k), time.monotonic()]), k))
    print(time.monotonic(), flush=True)
    time.sleep(0.002)
"""


@pytest.mark.parametrize("storage", STORAGES)
def test_a_killed_recording_is_whole_up_to_the_last_second(tmp_path, storage):
    """rosbags reads it as it is, and so does undertow; without metadata.yaml and cut off, undertow does."""
    command = [sys.executable, "-c", RECORDED, str(tmp_path / "bag"), storage]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        begun = float(process.stdout.readline())
        for line in process.stdout:
            if (ended := float(line)) - begun > 1.7:
                process.kill()
        ended = float(line)
    with Reader(tmp_path / "bag") as reader:
        found = [store_of_all().deserialize_cdr(data, one.msgtype).data for one, _, data in reader.messages()]
    assert [row[0] for row in found] == list(range(len(found)))
    assert ended - found[-1][1] < 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        series = read_rosbag2(tmp_path / "bag")
    assert sum(len(values) for _, values in series.values()) == len(found)
    assert len(read_log(tmp_path / "bag", MAPPING)["depth"].time) > 0
    (tmp_path / "bag" / "metadata.yaml").unlink()
    file = next((tmp_path / "bag").glob("*.mcap"), None)
    if file is not None:
        file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    with pytest.warns(UserWarning, match="the bag has no metadata.yaml"):
        again = read_rosbag2(tmp_path / "bag")
    rows = sum(len(values) for _, values in again.values())
    assert rows == len(found) if file is None else 0 < rows < len(found)
    log = read_log(tmp_path / "bag", MAPPING)
    assert len(log["depth"].time) > 0


MAPPING = mapping_of({"signals": {"depth": {"topic": "/t", "columns": ["data[0]"], "unit": "m"}}})


def store_of_all():
    return get_typestore(Stores.ROS2_HUMBLE)


def test_a_database_killed_within_a_commit_is_taken_back(tmp_path):
    """As SQLite leaves it: its journal stands beside it. Nothing in the folder changes."""
    with BagWriter(tmp_path / "bag", "sqlite3") as bag:
        bag.write(("/t", ros.Float64MultiArray(data=[1.0]), 10**9))
        bag.flush()
    file = tmp_path / "bag" / "bag.db3"
    connection = sqlite3.connect(file, isolation_level=None)
    connection.execute("PRAGMA cache_size = 1")  # so that changes go to the file before the commit
    connection.execute("BEGIN")
    connection.executemany("INSERT INTO messages VALUES (NULL, 1, 5, ?)", [(bytes(4000),) for _ in range(100)])
    files = {path.name: path.read_bytes() for path in (tmp_path / "bag").iterdir()}
    connection.close()
    assert "bag.db3-journal" in files
    (tmp_path / "killed").mkdir()
    for name, data in files.items():
        (tmp_path / "killed" / name).write_bytes(data)
    with pytest.warns(UserWarning, match=r"bag.db3 ends early"):
        found = read_rosbag2(tmp_path / "killed")
    assert found["/t"][1].tolist() == [[1.0]]
    assert {path.name: path.read_bytes() for path in (tmp_path / "killed").iterdir()} == files
