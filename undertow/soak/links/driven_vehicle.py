"""The vehicle behind a link, moved by the commands that come, and what it got."""

from pathlib import Path

import numpy as np

from undertow.interop.stepped_vehicle import State, SteppedVehicle
from undertow.soak.links.scenario import SUPPLY

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
    """

    def __init__(self, scenario: Path):
        self.stepped = SteppedVehicle(scenario)
        self.restart()

    def restart(self) -> None:
        """Go back to the start."""
        self.stepped.restart()
        self.failed, self.state = False, self.stepped.state()
        self._begun_at = self.state.position
        self.count_anew()

    def count_anew(self) -> None:
        """Forget what it got until now."""
        self.volt_seconds = self.full = self.longest_full = self.furthest = 0.0
        self._full = np.zeros(self.stepped.thrusters)

    def hold(self, volts: np.ndarray, dt: float) -> State:
        """Apply volts for a time, s; the state after it."""
        applied = np.clip(volts, -SUPPLY, SUPPLY)
        self.failed |= not self.stepped.hold(applied, dt)
        self.volt_seconds += dt * float(np.abs(applied).sum())
        at_full = np.abs(applied) >= FULL
        self.full += dt * bool(at_full.any())
        self._full = np.where(at_full, self._full + dt, 0.0)
        self.longest_full = max(self.longest_full, float(self._full.max()))
        self.state = self.stepped.state()
        self.furthest = max(self.furthest, float(np.linalg.norm(self.state.position - self._begun_at)))
        return self.state
