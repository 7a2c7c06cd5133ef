"""Messages have the bytes that rosbags gives them, both ways; damaged bytes are one error."""

import dataclasses

import numpy as np
import pytest
from random_messages import random_message

from undertow.core.errors import BadInput
from undertow.outside.ros2 import messages as ros

pytestmark = pytest.mark.interop


def plain(message):
    """A message of either library as dictionaries, lists and numbers."""
    if dataclasses.is_dataclass(message):
        return {
            field.name: plain(getattr(message, field.name))
            for field in dataclasses.fields(message)
            if field.name != "__msgtype__"
        }
    if isinstance(message, list | np.ndarray):
        return [plain(one) for one in message]
    return message.item() if isinstance(message, np.generic) else message


@pytest.mark.parametrize("kind", ros.TOP_LEVEL, ids=ros.ros_type)
def test_bytes_are_those_of_rosbags(kind):
    chance, name = np.random.default_rng(1), ros.ros_type(kind)
    for _ in range(100):
        message = random_message(kind, chance)
        data = message.serialize()
        theirs = ros.typestore().deserialize_cdr(data, name)
        assert plain(theirs) == plain(message)
        again = bytes(ros.typestore().serialize_cdr(theirs, name))
        assert again == data
        assert ros.decoded(kind, again) == message


@pytest.mark.parametrize("kind", ros.TOP_LEVEL, ids=ros.ros_type)
def test_big_endian_messages_are_read(kind):
    chance, name = np.random.default_rng(2), ros.ros_type(kind)
    message = random_message(kind, chance)
    theirs = ros.typestore().deserialize_cdr(message.serialize(), name)
    assert ros.decoded(kind, bytes(ros.typestore().serialize_cdr(theirs, name, little_endian=False))) == message


@pytest.mark.parametrize("kind", ros.TOP_LEVEL, ids=ros.ros_type)
def test_damaged_bytes_are_an_error_or_another_message(kind):
    """Seeded mutations and truncations: either one line, or a message; nothing else, and no large memory."""
    chance, refused = np.random.default_rng(3), 0
    for _ in range(500):
        data = bytearray(random_message(kind, chance).serialize())
        for place in chance.integers(0, len(data), 1 + chance.integers(4)):
            data[place] = chance.integers(256)
        if chance.random() < 0.5:
            data = data[: chance.integers(len(data))]
        try:
            assert isinstance(ros.decoded(kind, bytes(data)), kind)
        except BadInput as error:
            refused += 1
            assert "\n" not in str(error) and ros.ros_type(kind) in str(error)
    assert refused > 100


def test_names_and_hashes_of_types():
    """Hashes as `ros2 topic info --verbose` of ROS 2 Jazzy prints them."""
    published = {
        "nav_msgs/msg/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
        "sensor_msgs/msg/Imu": "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
        "geometry_msgs/msg/WrenchStamped": "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
        "geometry_msgs/msg/PoseStamped": "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
        "std_msgs/msg/Float64MultiArray": "1025ddc6b9552d191f89ef1a8d2f60f3d373e28b283d8891ddcc974e8c55397f",
    }
    found = {ros.ros_type(kind): ros.type_hash(kind) for kind in ros.TOP_LEVEL}
    assert found.keys() == {*published, "rosgraph_msgs/msg/Clock"}
    assert {name: found[name] for name in published} == {name: f"RIHS01_{one}" for name, one in published.items()}
