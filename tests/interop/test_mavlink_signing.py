"""Signatures of MAVLink 2: the file with the key, what is refused, and what a watchdog sends later."""

import hashlib
import time

import pytest
from mavlink_vehicle import MavlinkVehicle
from pymavlink.dialects.v20 import common as mavlink

from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.outside.mavlink import UdpLink, read_key
from undertow.outside.mavlink.message_codec import MessageCodec

pytestmark = pytest.mark.interop

KEY = bytes(range(200, 232))
HEARTBEAT = mavlink.MAVLink_heartbeat_message(12, 3, 128, 0, 4, 3)


@pytest.fixture
def codec():
    return MessageCodec(255, 191, KEY)


@pytest.fixture
def vehicle():
    """Another codec with the same key, as an autopilot has."""
    return MessageCodec(1, 1, KEY)


def key_file(folder, contents, mode=0o600):
    path = folder / "key"
    path.write_bytes(contents)
    path.chmod(mode)
    return path


@pytest.mark.parametrize("contents", [b"a tank with a line", b"a tank with a line\n", b"a tank with a line\r\n"])
def test_a_passphrase_gives_the_key_of_a_ground_station(tmp_path, contents):
    assert read_key(key_file(tmp_path, contents)) == hashlib.sha256(b"a tank with a line").digest()


def test_a_passphrase_of_32_letters_is_one(tmp_path):
    assert read_key(key_file(tmp_path, 32 * b"x")) == hashlib.sha256(32 * b"x").digest()


def test_32_bytes_are_the_key(tmp_path):
    assert read_key(key_file(tmp_path, KEY)) == KEY


@pytest.mark.parametrize("contents", [b"", b"\n", b"two\nlines", KEY[:31], 2 * KEY, 5000 * b"x"])
def test_files_that_hold_no_key(tmp_path, contents):
    with pytest.raises(BadInput, match="`--signing-key` must hold 32 bytes, or a passphrase in one line"):
        read_key(key_file(tmp_path, contents))


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o610])
def test_a_file_that_others_may_read(tmp_path, mode):
    path = key_file(tmp_path, KEY, mode)
    with pytest.raises(BadInput, match=f"be a file that only its owner may read, but is .* with mode {mode:o}"):
        read_key(path)


def test_a_file_that_is_not_there(tmp_path, capsys):
    words = ["mavlink", "no.yaml", "--connect", "udpin:127.0.0.1:0", "--signing-key", str(tmp_path / "none")]
    assert run(words) == 2
    assert "`--signing-key` must be a file that can be read" in capsys.readouterr().err


def test_messages_go_both_ways(codec, vehicle):
    for sender, receiver in ((codec, vehicle), (vehicle, codec), (codec, vehicle)):
        for data in sender.packed([HEARTBEAT, HEARTBEAT]):
            assert [one.get_type() for one in receiver.parsed(data)] == ["HEARTBEAT"]
    assert codec.counts == vehicle.counts == {"unsigned": 0, "wrongly signed": 0}


def test_what_is_not_signed_with_the_key_is_refused(codec):
    (unsigned,) = MessageCodec(1, 1).packed([HEARTBEAT])
    (other,) = MessageCodec(1, 1, KEY[::-1]).packed([HEARTBEAT])
    assert codec.parsed(unsigned) == codec.parsed(other) == codec.parsed(unsigned + other) == []
    assert codec.counts == {"unsigned": 2, "wrongly signed": 2}


def test_version_1_has_no_signatures(codec):
    assert codec.parsed(HEARTBEAT.pack(mavlink.MAVLink(None, 1, 1), force_mavlink1=True)) == []
    assert codec.counts["unsigned"] == 1


def test_a_replay_is_refused(codec, vehicle):
    first, second = vehicle.packed([HEARTBEAT, HEARTBEAT])
    assert codec.parsed(first) and codec.parsed(second)
    assert codec.parsed(first) == codec.parsed(second) == []
    assert codec.counts["wrongly signed"] == 2


def test_a_record_of_yesterday_is_refused_at_the_start(codec, vehicle):
    vehicle._signing.timestamp -= 100_000 * 61
    data = HEARTBEAT.pack(vehicle._packer)
    assert codec.parsed(data) == []


def test_a_forged_time_does_not_shut_the_vehicle_out(codec, vehicle):
    """A message of somebody else, as of the same sender, dated an hour ahead."""
    forger = MessageCodec(1, 1, KEY[::-1])
    forger._signing.timestamp += 100_000 * 3600
    assert codec.parsed(forger.packed([HEARTBEAT])[0]) == []
    assert codec.parsed(vehicle.packed([HEARTBEAT])[0])
    assert codec.parsed(forger.packed([HEARTBEAT])[0]) == []
    assert codec.parsed(vehicle.packed([HEARTBEAT])[0])


def test_what_a_watchdog_sends_is_newer_than_what_was_sent_meanwhile(codec, vehicle):
    """And what comes after a standstill is newer than that."""
    ahead = codec.packed_ahead([HEARTBEAT, HEARTBEAT])
    for data in codec.packed(200 * [HEARTBEAT]):
        assert vehicle.parsed(data)
    assert all(vehicle.parsed(data) for data in ahead)
    codec.overtake()
    assert vehicle.parsed(codec.packed([HEARTBEAT])[0])


def test_pymavlinks_own_connection_understands_it():
    with UdpLink("udpin:127.0.0.1:0", key=KEY) as link, MavlinkVehicle(f"udpout:127.0.0.1:{link.port}") as peer:
        peer.heartbeat()
        assert link.receive(5.0) == [] and link.codec.counts["unsigned"] == 1
        peer.link.setup_signing(KEY)
        peer.heartbeat()
        ((message, sender),) = link.receive(5.0)
        assert message.get_type() == "HEARTBEAT"
        link.peer = sender
        link.send([HEARTBEAT])
        assert peer.wait("HEARTBEAT").get_signed()


def test_an_autopilot_without_a_clock_gets_a_time():
    """Its signatures are of 2015: they are refused, but it receives ours, and by them sets its time."""
    with UdpLink("udpin:127.0.0.1:0", key=KEY) as link, MavlinkVehicle(f"udpout:127.0.0.1:{link.port}") as peer:
        peer.link.setup_signing(KEY, initial_timestamp=1)
        peer.heartbeat()
        assert link.receive(5.0) == [] and link.codec.counts["wrongly signed"] == 1
        link.send([HEARTBEAT])
        assert peer.wait("HEARTBEAT", timeout=5.0) is not None
        peer.heartbeat()
        until = time.monotonic() + 5.0
        found = []
        while not found and time.monotonic() < until:
            found = link.receive(0.5)
        assert [message.get_type() for message, _ in found] == ["HEARTBEAT"]
