"""The vehicle behind a link, moved by the commands that come, and what it got."""

from pathlib import Path

import numpy as np

from soak.links.scenario import SUPPLY
from undertow.outside.autopilot.measured_motion import MeasuredMotion
from undertow.outside.autopilot.vehicle import Vehicle

FULL = 0.95 * SUPPLY  # V


class DrivenVehicle:
    """A simulated vehicle that counts volt-seconds and full thrust, in steps of any length.

    Args:
        scenario: its file.

    Attributes:
        volt_seconds: sum over the thrusters of |voltage| times time, V s.
        full: time that any thruster had 95 % of its supply or more, s.
        longest_full: longest time that any thruster had 95 % of its supply or more without a pause, s.
        furthest: largest distance from its start, m.
        failed: whether its state is not finite any more.
        motion: true one, now: attitude as a quaternion, velocity in body axes.
    """

    def __init__(self, scenario: Path):
        self.vehicle = Vehicle(scenario, attitude="quaternion")
        self.restart()

    def restart(self) -> None:
        """Go back to the start."""
        self.vehicle.restart()
        self.failed, self.motion = False, self.vehicle.output.truth
        self._begun_at = self.motion.position
        self.count_anew()

    def count_anew(self) -> None:
        """Forget what it got until now."""
        self.volt_seconds = self.full = self.longest_full = self.furthest = 0.0
        self._full = np.zeros(self.vehicle.thrusters)

    def hold(self, volts: np.ndarray, dt: float) -> MeasuredMotion:
        """Apply volts for a time, s; the true motion after it."""
        applied = np.clip(volts, -SUPPLY, SUPPLY)
        if dt > 0:
            self.motion = self.vehicle.step(applied, dt).truth
        self.failed |= not self.vehicle.going_on
        self.volt_seconds += dt * float(np.abs(applied).sum())
        at_full = np.abs(applied) >= FULL
        self.full += dt * bool(at_full.any())
        self._full = np.where(at_full, self._full + dt, 0.0)
        self.longest_full = max(self.longest_full, float(self._full.max()))
        self.furthest = max(self.furthest, float(np.linalg.norm(self.motion.position - self._begun_at)))
        return self.motion
