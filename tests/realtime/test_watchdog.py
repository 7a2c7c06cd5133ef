"""The watchdog by itself: who stands still or is gone is replaced, who says that it is done is not."""

import os
import signal
import socket
import subprocess
import sys
import time

import pytest

CONTROLLER = """
import socket, sys, time
from undertow.outside.realtime.process_watchdog import Watchdog

own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
watchdog = Watchdog(own, 0.2)
address = "127.0.0.1", int(sys.argv[1])
watchdog.hold(address, [b"old"])
watchdog.hold(address, [b"stop 1", b"stop 2"])
own.sendto(b"begun", address)
while sys.argv[2] != "done":
    watchdog.alive()
    time.sleep(0.02)
watchdog.done()
"""


@pytest.fixture
def vehicle():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        yield one


def controller(vehicle, how):
    port = str(vehicle.getsockname()[1])
    process = subprocess.Popen([sys.executable, "-c", CONTROLLER, port, how])
    vehicle.settimeout(60)
    assert vehicle.recv(100) == b"begun"
    return process


def received(vehicle, seconds):
    """What came within so many seconds."""
    found, until = [], time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        vehicle.settimeout(left)
        try:
            found.append(vehicle.recv(100))
        except TimeoutError:
            break
    return found


@pytest.mark.full
def test_it_is_silent_while_there_are_signs_of_life(vehicle):
    process = controller(vehicle, "control")
    try:
        assert received(vehicle, 0.6) == []
    finally:
        process.kill()
        process.wait()


@pytest.mark.full
def test_it_is_silent_after_a_controller_that_is_done(vehicle):
    assert controller(vehicle, "done").wait(20) == 0
    assert received(vehicle, 0.5) == []


@pytest.mark.parametrize(
    "how", [signal.SIGKILL, *(pytest.param(one, marks=pytest.mark.full) for one in (signal.SIGTERM, signal.SIGSEGV))]
)
def test_it_stops_the_vehicle_of_a_controller_that_is_gone(vehicle, how):
    process = controller(vehicle, "control")
    os.kill(process.pid, how)
    assert process.wait(20) == -how
    assert received(vehicle, 0.6) == 5 * [b"stop 1", b"stop 2"]


def test_it_stops_the_vehicle_of_a_controller_that_stands_still(vehicle):
    process = controller(vehicle, "control")
    try:
        os.kill(process.pid, signal.SIGSTOP)
        vehicle.settimeout(20)
        assert vehicle.recv(100) == b"stop 1"
        os.kill(process.pid, signal.SIGCONT)
        received(vehicle, 0.3)
        assert received(vehicle, 0.5) == []
    finally:
        process.kill()
        process.wait()
