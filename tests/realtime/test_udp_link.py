"""UDP on the loopback device, with the simulated vehicle in another thread."""

import contextlib
import select
import socket
import struct
import threading
import time

import numpy as np
import pytest

import undertow as ut
from undertow.core.errors import BadInput
from undertow.outside.realtime.control_loop import LoopSettings, RealTimeLoop, Reason
from undertow.outside.realtime.datagrams import COMMAND, MEASUREMENT, DatagramFilter, Sender
from undertow.outside.realtime.loop_clock import SimulatedClock
from undertow.outside.realtime.udp_link import UdpVehicleLink, UdpVehicleServer
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

pytestmark = pytest.mark.full

AT_REST = np.concatenate([np.zeros(3), [1, 0, 0, 0], np.zeros(6 + 8)])
SAFE = 0.125


class LockStep(SimulatedClock):
    """Time goes on when the link has something to read, or when nothing can come any more."""

    def __init__(self, link, alive):
        super().__init__()
        self.link, self.alive = link, alive

    def sleep_until(self, instant):
        while self.alive() and not select.select([self.link], [], [], 0.01)[0]:
            pass
        super().sleep_until(instant)


@pytest.fixture(scope="module")
def autopilot(heavy):
    return ut.Autopilot(heavy, attitude="quaternion", velocity="body")


@pytest.fixture
def place():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{free.getsockname()[1]}"


@contextlib.contextmanager
def served(built, place):
    server, ended = UdpVehicleServer(built, place), threading.Event()
    thread = threading.Thread(target=server.serve, args=(ended.is_set,))
    thread.start()
    try:
        yield server, thread.is_alive
    finally:
        time.sleep(0.1)  # what is under way arrives
        ended.set()
        thread.join(10)
        server.close()


def test_a_run_over_udp_has_the_bits_of_a_simulation(heavy, heavy_data, autopilot, place):
    with served(heavy, place) as (server, alive):
        link = UdpVehicleLink(place, heavy)
        sent, send = [], link.send
        link.send = lambda command: (sent.append(command.copy()), send(command))
        loop = RealTimeLoop(autopilot, link, LockStep(link, alive), LoopSettings(safe=SAFE))
        assert loop.run(100) is Reason.COMPLETED
    record = ut.simulate_scenario(heavy_data).dataset
    np.testing.assert_array_equal(sent, record["commanded_input"].values[:-1])
    assert link.counts()["received"] == 100 and loop.statistics.stale == 0
    np.testing.assert_array_equal(server.last_command, SAFE)


class Peer:
    """The other end by hand: it answers with what the test gives."""

    def __init__(self, place):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        host, port = place.split(":")
        self.socket.bind((host, int(port)))
        self.socket.settimeout(60.0)  # a step that is compiled on a busy machine takes long
        self.received, self.sender = DatagramFilter(COMMAND, 8), Sender(MEASUREMENT, 8, 5)

    def take(self):
        data, self.at = self.socket.recvfrom(2048)
        return self.received.take(data)

    def send(self, data):
        self.socket.sendto(data, self.at)

    def measurement(self):
        return self.sender.pack(AT_REST, 0, 0, True)

    def drained(self):
        """All commands that are there."""
        self.socket.settimeout(0.2)
        found = []
        with contextlib.suppress(TimeoutError):
            while True:
                found.append(self.take())
        return found


@pytest.fixture
def peer(place):
    found = Peer(place)
    yield found
    found.socket.close()


@pytest.fixture
def link(place, peer, heavy):
    found = UdpVehicleLink(place, heavy)
    yield found
    found.finish(np.full(8, SAFE))


def awaited(link):
    select.select([link], [], [], 5.0)
    return link.receive(0.0)


def test_hostile_packets_are_counted_and_the_newest_sound_one_is_taken(link, peer):
    link.await_measurement(np.full(8, SAFE))
    hello = peer.take()
    assert hello is not None and hello.flag and (hello.values == SAFE).all()
    old, new = peer.measurement(), peer.measurement()
    last = peer.sender.pack(AT_REST + np.eye(21)[0], 0, 0, False)
    for data in (new, old, b"", b"x", new[:-1] + b"!", last, last):
        peer.send(data)
    time.sleep(0.05)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(peer.measurement(), link._socket.getsockname())
        time.sleep(0.05)
        found = awaited(link)
    assert found is not None and found.position[0] == 1.0 and found.applied is None
    counts = {name: number for name, number in link.counts().items() if number}
    assert counts == {"sent": 1, "another sender": 1, "received": 2, "wrong size": 2, "damaged": 1, "repeated": 2}


def test_a_flood_does_not_stop_a_step(link, peer):
    """Of 2,000 datagrams at once, no step reads more than 256; the rest waits or is lost."""
    link.await_measurement(np.zeros(8))
    peer.take()
    for _ in range(2000):
        peer.send(b"flood")
    time.sleep(0.05)
    assert link.receive(0.0) is None
    assert link.counts()["wrong size"] == 256 and link.counts()["left unread"] == 1


def test_a_lost_peer_leads_to_the_safe_output_after_the_stated_time(autopilot, heavy, place, peer):
    """The peer answers 20 times and dies: 0.1 s later the safe output is the last thing sent, thrice."""
    link = UdpVehicleLink(place, heavy)
    answers = threading.Thread(target=lambda: [(peer.take(), peer.send(peer.measurement())) for _ in range(20)])
    loop = RealTimeLoop(autopilot, link, LockStep(link, answers.is_alive), LoopSettings(safe=SAFE, max_age=0.1))
    answers.start()
    assert loop.run() is Reason.LINK_LOST
    answers.join()
    assert loop.statistics.stale >= 10 and loop.statistics.longest_stale == pytest.approx(0.1)
    commands = peer.drained()
    assert len(commands) > 10 and all((one.values == SAFE).all() for one in commands[-3:])
    assert not (commands[-4].values == SAFE).all()


def test_an_unknown_host_and_a_taken_port(heavy, place, peer):
    with pytest.raises(BadInput, match="known"):
        UdpVehicleLink("no.such.host.invalid:5000", heavy)
    with pytest.raises(BadInput, match="free to use"):
        UdpVehicleServer(heavy, place)


def test_only_vehicles_have_datagrams(place):
    pendulum = {
        "plant": "inverted_pendulum",
        "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
        "loop": {"duration": 1.0, "dt": 0.001},
    }
    with pytest.raises(BadInput, match="vehicle with thrusters"):
        UdpVehicleLink(place, build(from_data(pendulum)))


def test_a_datagram_is_documented_by_its_bytes(peer, link):
    """A peer in another language needs no more than this."""
    link.await_measurement(np.arange(8.0))
    data, _ = peer.socket.recvfrom(2048)
    magic, version, kind, flags, actuators = struct.unpack_from("<4sBBBB", data)
    assert (magic, version, kind, flags, actuators) == (b"UTOW", 1, 2, 1, 8)
    np.testing.assert_array_equal(np.frombuffer(data, "<f8", 8, 28), np.arange(8.0))
