"""An autopilot as ArduPilot behaves at its socket: one packet, one reply, the same packet again without one.

It reads a reply as SIM_JSON.cpp does: what stands between the last two line ends, each key by a search for its name, and
a vector right behind the colon. It holds depth, heading, roll and pitch with a PID each, through ArduSub's mixer.
"""

import re
import socket
import struct

import numpy as np

from undertow.outside.thruster_channels import FRAMES

MOTORS = np.array(FRAMES["vectored_6dof"], dtype=float)
GAINS = np.array([[0.3, 0, 0.1], [0.3, 0, 0.1], [0.8, 0.2, 0.4], [1.5, 0.3, 0.8]])  # roll, pitch, yaw, up


def vector(text, key):
    found = re.search(rf'"{key}":\[([^\]]*)\]', text)
    assert found, f"{key} is missing in {text}"
    return np.array([float(number) for number in found[1].split(", " if ", " in found[1] else ",")])


class FakeAutopilot:
    """Holds a depth (m) and a heading (rad)."""

    def __init__(self, address, rate, depth, heading):
        self.link, self.address, self.rate = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), address, rate
        self.link.settimeout(1.0)
        self.depth, self.heading = depth, heading
        self.frame_count, self.sums, self.text, self.resent = 0, np.zeros(4), "", 0
        self.pwm = [1500] * 8 + [0] * 8

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.link.close()

    def exchange(self):
        packet = struct.pack("<HHI16H", 18458, self.rate, self.frame_count, *self.pwm)
        for _ in range(60):
            self.link.sendto(packet, self.address)
            try:
                data = self.link.recv(65000)
                break
            except TimeoutError:
                self.resent += 1
        else:
            raise TimeoutError("no reply within a minute")
        rows = data.replace(b"\n", b"\0").split(b"\0")
        self.text = rows[-2].decode("ascii")
        self.frame_count += 1

    def angles(self):
        w, x, y, z = vector(self.text, "quaternion")
        roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        return np.array(
            [roll, np.arcsin(2 * (w * y - z * x)), np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))]
        )

    def control(self):
        errors = np.append(
            np.array([0, 0, self.heading]) - self.angles(), vector(self.text, "position")[2] - self.depth
        )
        rates = np.append(vector(self.text, "gyro"), -vector(self.text, "velocity")[2])
        self.sums += errors / self.rate
        demand = GAINS[:, 0] * errors + GAINS[:, 1] * self.sums - GAINS[:, 2] * rates
        thrust = np.clip(MOTORS[:, :4] @ np.clip(demand, -0.5, 0.5), -1, 1)
        self.pwm[:8] = [round(1500 + 400 * share) for share in thrust]
