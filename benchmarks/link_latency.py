"""Time from a packet to its answer, through `undertow ardupilot` and `undertow mavlink` on this machine.

    python benchmarks/link_latency.py [--steps 2000] [--rate 100] [--json]

The commands run in processes of their own, as users run them, with examples/bluerov2_heavy.yaml (the vehicle at sea;
the law of the preset `robust`). This process is the autopilot: it sends over the loopback interface, waits for the
answer, and takes the time of both ways. `--rate` is that of the packets, Hz; 0 sends the next one at once.
"""

import argparse
import contextlib
import json
import re
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from pymavlink.dialects.v20 import common as mavlink

from undertow.outside.mavlink.message_codec import parsed
from undertow.outside.realtime.loop_statistics import Durations

SCENARIO = Path(__file__).parents[1] / "examples/bluerov2_heavy.yaml"
WARM_UP = 50  # steps that are not counted


@contextlib.contextmanager
def command(*arguments: str) -> Iterator[int]:
    """The port on which a command listens, while it runs."""
    whole = [sys.executable, "-m", "undertow", arguments[0], str(SCENARIO), *arguments[1:]]
    with subprocess.Popen(whole, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            assert process.stdout is not None
            lines = (re.search(r"(?:127\.0\.0\.1:|port )(\d+)\.", line) for line in process.stdout)
            yield next(int(found[1]) for found in lines if found)
        finally:
            process.terminate()


def measured(exchange: Callable[[int], None], steps: int, rate: float) -> dict[str, float]:
    """Time of exchanges, ms."""
    latency = Durations()
    due = time.perf_counter()
    for step in range(-WARM_UP, steps):
        due += 1 / rate if rate else 0.0
        time.sleep(max(0.0, due - time.perf_counter()))
        begun = time.perf_counter()
        exchange(step + WARM_UP)
        if step >= 0:
            latency.add(time.perf_counter() - begun)
    return {"steps": steps, **latency.milliseconds()}


def through_ardupilot(steps: int, rate: float) -> dict[str, float]:
    """Servo packet -> the line of JSON."""
    with command("ardupilot", "--port", "0") as port, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.settimeout(10)

        def exchange(step: int) -> None:
            pulse = 1500 + step % 200
            link.sendto(struct.pack("<HHI16H", 18458, 400, step, *([pulse] * 8 + [0] * 8)), ("127.0.0.1", port))
            link.recv(65535)

        return measured(exchange, steps, rate)


def through_mavlink(steps: int, rate: float) -> dict[str, float]:
    """ODOMETRY -> RC_CHANNELS_OVERRIDE."""
    wire = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    none = 21 * [0.0]
    with command("mavlink", "--connect", "udpin:127.0.0.1:0") as port:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.settimeout(10)

            def exchange(step: int) -> None:
                if step % 50 == 0:
                    alive = mavlink.MAVLink_heartbeat_message(12, 3, mavlink.MAV_MODE_FLAG_SAFETY_ARMED, 0, 4, 3)
                    link.sendto(alive.pack(wire), ("127.0.0.1", port))
                motion = [0.001 * (step % 100), 0, 0, [1, 0, 0, 0], 0, 0, 0, 0, 0, 0]
                sent = mavlink.MAVLink_odometry_message(10_000 * (step + 1), 1, 12, *motion, none, none, 0, 3, 0)
                link.sendto(sent.pack(wire), ("127.0.0.1", port))
                while not any(one.get_type() == "RC_CHANNELS_OVERRIDE" for one in parsed(link.recv(65535))):
                    pass

            return measured(exchange, steps, rate)


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--steps", type=int, default=2000)
    options.add_argument("--rate", type=float, default=100.0)
    options.add_argument("--json", action="store_true")
    given = options.parse_args()
    found = {
        "ardupilot": through_ardupilot(given.steps, given.rate),
        "mavlink": through_mavlink(given.steps, given.rate),
    }
    if given.json:
        print(json.dumps(found))
        return
    for name, values in found.items():
        numbers = ", ".join(f"{key} {value:.2f} ms" for key, value in values.items() if key != "steps")
        print(f"{name:<10} {values['steps']} steps: {numbers}")


if __name__ == "__main__":
    main()
