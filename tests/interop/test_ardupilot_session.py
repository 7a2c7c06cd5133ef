"""Lock step with ArduPilot: the rule for each kind of datagram, bytes that are anything, and parity with `simulate`."""

import json
import struct

import numpy as np
import pytest
from driven_scenario import DRIVEN

import undertow as ut
from undertow.outside.ardupilot.session import SILENCE, Session
from undertow.outside.thruster_channels import channels_from_text

pytestmark = pytest.mark.interop

SITL, OTHER = ("127.0.0.1", 40001), ("127.0.0.1", 40002)
REVERSED = "-1,-2,-3,-4,-5,-6,-7,-8"


def packet(count, pwm=(), rate=100, magic=18458):
    channels = {18458: 16, 29569: 32}[magic]
    return struct.pack(f"<HHI{channels}H", magic, rate, count, *(list(pwm) + [0] * channels)[:channels])


def read(answer):
    """A reply as ArduPilot frames it: what stands between the last two line ends."""
    assert answer.count(b"\n") == 2 and answer.startswith(b"\n") and answer.endswith(b"\n")
    return json.loads(answer)


@pytest.fixture
def session(vehicle):
    return Session(vehicle, channels_from_text(REVERSED, 8))


def test_states_are_those_of_a_simulation_bit_by_bit(session):
    """Pulses of a recorded run, on reversed channels: positions and velocities as written in the replies."""
    run = ut.simulate_scenario(DRIVEN).dataset
    pwm = 1500 - np.round(400 * run["input"].values[:-1] / 16).astype(int)
    found = [read(session.answer(packet(k, given), SITL, 0.0)) for k, given in enumerate(pwm)]
    np.testing.assert_array_equal([one["position"] for one in found], run["position"].values[1:, :3])
    np.testing.assert_array_equal([one["velocity"] for one in found], run["velocity"].values[1:, :3])
    np.testing.assert_array_equal([one["timestamp"] for one in found], run["time"].values[1:])


def test_time_is_that_of_the_frames(session):
    """400 Hz, then 1200 Hz: by frames, whatever the clock of the machine says."""
    times = [read(session.answer(packet(k, rate=400), SITL, 1e3 * k))["timestamp"] for k in range(4)]
    np.testing.assert_array_equal(times, np.arange(1, 5) * (1 / 400))
    times = [read(session.answer(packet(k, rate=1200), SITL, 0.0))["timestamp"] for k in range(4, 7)]
    np.testing.assert_allclose(times, 0.01 + np.arange(1, 4) / 1200, rtol=1e-14)
    assert session.counts["frames"] == 7 and session.frame_rate == 1200


def test_a_packet_that_comes_again_gets_the_same_reply(session):
    first = session.answer(packet(5, [1600] * 8), SITL, 0.0)
    assert session.answer(packet(5, [1100] * 8), SITL, 1.0) == first
    assert session.counts["repeated"] == 1 and session.counts["frames"] == 1


def test_a_late_copy_is_ignored(session):
    session.answer(packet(5), SITL, 0.0)
    session.answer(packet(6), SITL, 0.0)
    time = session.vehicle.time
    assert session.answer(packet(5), SITL, 0.0) is None
    assert session.vehicle.time == time and session.counts["late"] == 1


def test_one_old_packet_or_flipped_bit_does_not_restart_the_physics(session):
    """Of ten frames back, and with a bit of the count at zero; a reboot that goes on from there is believed."""
    for count in range(60, 70):
        session.answer(packet(count), SITL, 0.0)
    time = session.vehicle.time
    for wrong in (60, 69 & ~64, 12):
        assert session.answer(packet(wrong), SITL, 0.0) is None
        assert session.answer(packet(session._last + 1), SITL, 0.0) is not None
    assert session.vehicle.time > time and session.counts["late"] == 3 and session.counts["restarts"] == 0
    assert session.answer(packet(20), SITL, 0.0) is None
    assert read(session.answer(packet(20), SITL, 1.0))["timestamp"] == 0.01 and session.counts["restarts"] == 1


def test_another_process_of_the_machine_is_let_in_with_its_first_frame(session):
    """ArduPilot gets another port when it reboots; a machine that is not the same has to wait."""
    session.answer(packet(7), SITL, 0.0)
    assert session.answer(packet(0), ("10.0.0.9", 40001), 0.1) is None
    assert session.answer(packet(0), OTHER, 0.1) is not None
    assert session.sender == OTHER and session.counts["restarts"] == 1 and session.vehicle.time == 0.01


def test_lost_packets_are_counted_and_not_made_up(session):
    """The autopilot takes its time from the reply, so one packet is one frame."""
    session.answer(packet(5), SITL, 0.0)
    assert read(session.answer(packet(9), SITL, 0.0))["timestamp"] == 0.02
    assert session.counts["lost"] == 3 and session.counts["restarts"] == 0


def test_an_autopilot_that_starts_again_finds_the_vehicle_at_its_start(session):
    first = [session.answer(packet(k, [1700] * 8), SITL, 0.0) for k in range(50)]
    assert session.answer(packet(0, [1700] * 8), SITL, 0.0) is None  # which it sends again without an answer
    again = [session.answer(packet(k, [1700] * 8), SITL, 0.0) for k in range(10)]
    assert again == first[:10] and session.counts["restarts"] == 1
    assert session.answer(packet(0, [1700] * 8), SITL, SILENCE) == first[0] and session.counts["restarts"] == 2


def test_a_copy_of_the_first_frame_does_not_restart_the_physics(session):
    """Found by `soak links`: a zero was believed at once."""
    for count in range(20):
        session.answer(packet(count), SITL, 0.0)
    assert session.answer(packet(0), SITL, 0.0) is None and session.answer(packet(20), SITL, 0.0) is not None
    assert session.counts["late"] == 1 and session.counts["restarts"] == 0 and session.vehicle.time == 0.21


def test_a_session_may_begin_at_any_count(session):
    assert read(session.answer(packet(123456), SITL, 0.0))["timestamp"] == 0.01
    assert session.counts["lost"] == 0 and session.counts["restarts"] == 0


def test_others_are_ignored_while_the_autopilot_is_there(session):
    session.answer(packet(7), SITL, 0.0)
    assert session.answer(packet(3), OTHER, SILENCE - 0.1) is None
    assert session.counts["strangers"] == 1 and session.vehicle.time == 0.01 and session.sender == SITL
    assert session.answer(packet(8), SITL, 1.0) is not None
    assert session.answer(packet(0), OTHER, 1.0 + SILENCE) is not None  # the autopilot again, from another port
    assert session.sender == OTHER and session.counts["restarts"] == 1 and session.vehicle.time == 0.01


def test_channels_that_are_not_driven_are_off(session):
    """0, 65535 and what no servo sends: zero volts, not full reverse."""
    session.answer(packet(0, [0, 65535, 1, 799, 2201, 1600, 1400, 1500]), SITL, 0.0)
    np.testing.assert_array_equal(session.vehicle.vehicle.output.applied, [0, 0, 0, 0, 0, -4, 4, 0])
    assert session.undriven == 5


def test_32_channels(vehicle):
    session = Session(vehicle, channels_from_text("25,26,27,28,29,30,31,-32", 8))
    assert session.answer(packet(0, [1600] * 16), SITL, 0.0) is None
    assert "`channels` must be of the 16 that arrive, but is 32" in session.complaint
    assert session.answer(packet(0, [0] * 24 + [1600] * 8, magic=29569), SITL, 0.0) is not None
    np.testing.assert_array_equal(session.vehicle.vehicle.output.applied, [4] * 7 + [-4])


def test_anything_may_arrive(session):
    """Mutated and random datagrams: none raises, each has one rule, and the vehicle stays finite."""
    chance = np.random.default_rng(20261124)
    count, sent = 0, 3000
    for _ in range(sent):
        data = bytearray(packet(count, chance.integers(0, 65536, 16), rate=int(chance.integers(50, 65536))))
        kind = chance.integers(4)
        if kind == 0:
            count += 1
        elif kind == 1:
            data[chance.integers(2)] ^= int(chance.integers(1, 256))
        elif kind == 2:
            data = data[: chance.integers(len(data))] + chance.bytes(int(chance.integers(40)))
        else:
            data[chance.integers(2, 8)] ^= 1 << int(chance.integers(8))
            data[2:4] = max(50, int.from_bytes(data[2:4], "little")).to_bytes(2, "little")
        answer = session.answer(bytes(data), SITL if chance.integers(8) else OTHER, 0.0)
        if answer is not None:
            read(answer)
    counts = session.counts
    one_each = ("frames", "repeated", "late", "invalid", "strangers")
    assert sum(counts[name] for name in one_each) == sent
    assert all(counts[name] > 10 for name in ("frames", "repeated", "invalid", "strangers", "restarts"))
    assert np.isfinite(session.vehicle.state().position).all()


def test_a_vehicle_that_cannot_go_on_ends_the_session(session):
    """The last valid reply is repeated until the autopilot starts again."""
    valid = session.answer(packet(0), SITL, 0.0)
    session.vehicle.vehicle.state.nu[...] = 1e9
    assert session.answer(packet(1), SITL, 0.0) == valid and session.ended
    assert session.answer(packet(0), SITL, 1.0) is None  # a late copy
    session.answer(packet(2), SITL, 1.0)
    assert session.answer(packet(0), SITL, 1.0 + SILENCE) == valid and not session.ended
