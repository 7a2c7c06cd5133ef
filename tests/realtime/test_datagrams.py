"""Datagrams: layout, round trip, and everything that a hostile network may send."""

import struct
import zlib

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.outside.realtime.datagrams import COMMAND, MEASUREMENT, DatagramFilter, Sender, address_of, size_of

N = 8
UPRIGHT = np.concatenate([[1.0, -2.0, 3.0], [1, 0, 0, 0], np.linspace(-0.3, 0.3, 6), np.linspace(-5, 5, N)])


def sender(kind=MEASUREMENT, session=77):
    return Sender(kind, N, session)


def test_the_layout_is_the_documented_one():
    packed = sender().pack(UPRIGHT, time=-5, answered=9, flag=True)
    body = struct.pack("<4sBBBBIIqI21d", b"UTOW", 1, 1, 1, N, 77, 1, -5, 9, *UPRIGHT)
    assert packed == body + struct.pack("<I", zlib.crc32(body))
    assert len(packed) == size_of(MEASUREMENT, N) == 28 + 8 * 21 + 4
    assert size_of(COMMAND, N) == 28 + 8 * 8 + 4


def test_numbers_survive_bit_for_bit():
    chance, received, of = np.random.default_rng(0), DatagramFilter(COMMAND, N), sender(COMMAND)
    for k in range(200):
        values = chance.normal(size=N) * 10.0 ** chance.integers(-300, 5, N)
        found = received.take(of.pack(values, k, 0))
        assert found is not None and found.values.tobytes() == values.tobytes() and found.sequence == k + 1
    assert received.counts["received"] == 200 == sum(received.counts.values())


def sealed(body):
    return body + struct.pack("<I", zlib.crc32(body))


@pytest.mark.parametrize(
    "reason, change",
    [
        ("wrong size", lambda data: data[:-1]),
        ("wrong size", lambda data: data + b"\0"),
        ("wrong size", lambda data: b""),
        ("wrong size", lambda data: b"x" * 65_000),
        ("damaged", lambda data: data[:40] + bytes([data[40] ^ 1]) + data[41:]),
        ("foreign", lambda data: sealed(b"XTOW" + data[4:-4])),
        ("foreign", lambda data: sealed(data[:4] + b"\2" + data[5:-4])),
        ("foreign", lambda data: sealed(data[:5] + b"\2" + data[6:-4])),
        ("foreign", lambda data: sealed(data[:6] + b"\4" + data[7:-4])),
        ("foreign", lambda data: sealed(data[:7] + b"\6" + data[8:-4])),
        ("invalid", lambda data: sealed(data[:28] + struct.pack("<d", np.inf) + data[36:-4])),
        ("invalid", lambda data: sealed(data[:28] + struct.pack("<d", -np.inf) + data[36:-4])),
        ("invalid", lambda data: sealed(data[:28] + struct.pack("<d", 1e300) + data[36:-4])),
        ("invalid", lambda data: sealed(data[:52] + struct.pack("<d", 0.0) + data[60:-4])),  # w of the quaternion
    ],
)
def test_what_cannot_be_used_is_counted(reason, change):
    received, of = DatagramFilter(MEASUREMENT, N), sender()
    assert received.take(change(of.pack(UPRIGHT, 0, 0))) is None
    assert received.counts[reason] == 1 == sum(received.counts.values())
    assert received.take(of.pack(UPRIGHT, 0, 0)) is not None


def test_old_and_foreign_sessions_and_numbers_are_refused():
    received, of, other = DatagramFilter(MEASUREMENT, N), sender(), sender(session=78)
    packets = [of.pack(UPRIGHT, k, 0) for k in range(4)]
    taken = [received.take(packets[k]) is not None for k in (1, 1, 0, 3, 2, 3)]
    assert taken == [True, False, False, True, False, False]
    assert received.take(other.pack(UPRIGHT, 0, 0)) is None
    assert (received.counts["repeated"], received.counts["other session"]) == (4, 1)


def test_a_sequence_begins_again_after_its_largest_number():
    of, received = sender(), DatagramFilter(MEASUREMENT, N)
    of._sequence = 2**32 - 3
    taken = [received.take(of.pack(UPRIGHT, 0, 0)) for _ in range(5)]
    assert [one and one.sequence for one in taken] == [2**32 - 2, 2**32 - 1, 1, 2, 3]


@pytest.mark.parametrize("wrong", [0, 2**32 - 1, 2**31 - 1, 50_000])
def test_one_wrong_number_does_not_end_a_connection(wrong):
    of, received = sender(), DatagramFilter(MEASUREMENT, N)
    assert received.take(of.pack(UPRIGHT, 0, 0)) is not None
    at, of._sequence = of._sequence, wrong - 1
    forged = of._packed(wrong, UPRIGHT, 0, 0, False)
    assert received.take(forged) is None
    of._sequence = at
    assert all(received.take(of.pack(UPRIGHT, 0, 0)) is not None for _ in range(3))
    assert received.take(forged) is None


def test_a_sender_of_whom_much_was_lost_is_accepted_again():
    """More datagrams were lost than the window holds: the second one counts."""
    of, received = sender(), DatagramFilter(MEASUREMENT, N)
    assert received.take(of.pack(UPRIGHT, 0, 0)) is not None
    of._sequence += 50_000
    assert [received.take(of.pack(UPRIGHT, 0, 0)) is not None for _ in range(3)] == [False, True, True]
    assert received.counts["far ahead"] == 1


@pytest.mark.parametrize(("entry", "value"), [(0, 1.1e4), (2, -1e5), (7, 21.0), (9, -9e5), (10, 25.0)])
def test_motions_of_no_vehicle_are_refused(entry, value):
    received, values = DatagramFilter(MEASUREMENT, N), UPRIGHT.copy()
    values[entry] = value
    assert received.take(sender().pack(values, 0, 0)) is None and received.counts["implausible"] == 1


@pytest.mark.full
def test_20000_mutated_datagrams_are_refused_or_sound():
    """Bytes changed, cut, joined, with and without a right checksum: no exception, and only sound numbers pass."""
    chance, passed = np.random.default_rng(2), 0
    received, of = DatagramFilter(MEASUREMENT, N), sender()
    for k in range(20_000):
        data = bytearray(of.pack(UPRIGHT, k, 0))
        for _ in range(chance.integers(1, 6)):
            data[chance.integers(len(data))] = chance.integers(256)
        kind = chance.integers(4)
        if kind == 0:
            data = data[: chance.integers(len(data) + 1)]
        elif kind == 1:
            data = bytearray(sealed(bytes(data[:-4])))
        elif kind == 2:
            data = bytearray(chance.bytes(int(chance.integers(400))))
        found = received.take(bytes(data))
        if found is not None:
            passed += 1
            assert np.isfinite(found.values).all() and np.abs(found.values).max() < 1e6
            assert abs((found.values[3:7] ** 2).sum() - 1) <= 1e-3
            received.newest = None  # a mutated number or session does not end the test
    assert sum(received.counts.values()) == 20_000 and passed == received.counts["received"]
    assert passed > 100 and all(received.counts[name] for name in ("wrong size", "damaged", "foreign", "invalid"))


@pytest.mark.parametrize("place", ["", "host", ":1", "host:", "host:0", "host:65536", "host:-1", "host:x", "host:1²"])
def test_addresses_that_are_none(place):
    with pytest.raises(BadInput, match="HOST:PORT"):
        address_of(place, "--link")
