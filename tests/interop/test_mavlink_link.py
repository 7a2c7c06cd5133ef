"""`undertow mavlink` with pymavlink as the vehicle at the other end of the socket: a closed loop, and what goes wrong."""

import contextlib
import re
import signal
import socket
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import DRIVEN
from mavlink_vehicle import MavlinkVehicle

import undertow as ut
from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.interop.mavlink import Companion, UdpLink, accompany
from undertow.interop.mavlink.link import parsed, status_line
from undertow.interop.latency import Latency

FRAMES = round(DRIVEN["loop"]["duration"] / DRIVEN["loop"]["dt"])
# Odometry holds single precision: 6e-8 of a metre and of a quaternion. A command on the edge between two pulses may
# be the other one: 1 us of 400, 0.04 V of 16. What a simulation of 2 s makes of both, m and m/s.
CLOSE = 2e-4


@pytest.fixture(scope="module")
def companion(driven):
    """Starts at once, as a simulation does."""
    return Companion(driven, blend=0.0, timeout=5.0)


@contextlib.contextmanager
def accompanied(companion, link, **options):
    """The companion talks in a thread, until the block ends."""
    ended = threading.Event()
    options |= {"until": ended.is_set}
    thread = threading.Thread(target=accompany, args=(companion, link), kwargs=options)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(10)


def closed_loop(vehicle, peer, send):
    """Positions of the vehicle as its own odometry and the companion's commands move it."""
    found = []
    for frame in range(FRAMES):
        if frame % 20 == 0:
            peer.heartbeat()
        state = vehicle.state()
        found.append(np.concatenate([state.position, state.velocity]))
        send(frame, state)
        vehicle.step(peer.pulses(), 0.01)
    return np.array(found)


@pytest.mark.parametrize("source", ["odometry", "local_position"])
@pytest.mark.parametrize("listens", ["companion", "vehicle"])
def test_a_closed_loop_is_that_of_a_simulation(driven, vehicle, source, listens):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        place = f"127.0.0.1:{free.getsockname()[1]}"
    companion = Companion(driven, source=source, blend=0.0, timeout=5.0)
    kinds = ("udpin", "udpout") if listens == "companion" else ("udpout", "udpin")
    first, second = (lambda: UdpLink(f"{kinds[0]}:{place}")), (lambda: MavlinkVehicle(f"{kinds[1]}:{place}"))
    with first() as link, second() as peer, accompanied(companion, link):
        if listens == "vehicle":
            assert peer.wait("HEARTBEAT").get_srcSystem() == 255
        if source == "odometry":
            send = lambda frame, state: peer.odometry(5_000_000 + 10_000 * frame, state)
        else:
            send = lambda frame, state: peer.position_and_attitude(5_000 + 10 * frame, state)
        found = closed_loop(vehicle, peer, send)
        assert companion.counts == dict.fromkeys(companion.counts, 0) | {"steps": FRAMES, "starts": 1}
        assert companion.steps_counted == {"steps": FRAMES - 1, "late": 0, "missed": 0, "repeated": 0}
    run = ut.simulate_scenario(DRIVEN).dataset
    expected = np.concatenate([run["position"].values[:-1, :3], run["velocity"].values[:-1, :3]], axis=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=CLOSE)
    assert np.abs(expected[-1] - expected[0]).max() > 0.2  # it has moved a thousand times as far
