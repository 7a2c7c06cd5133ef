"""Record of a test bench: volts, thrust, current and speed of one thruster, in our units."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

Rows = Float[np.ndarray, " rows"]

MEASURED = ("thrust", "current", "speed")
UNIT_OF = {"thrust": "N", "current": "A", "speed": "rad/s"}


class BenchTable(NamedTuple):
    """Rows of a bench; NaN where nothing was measured.

    Attributes:
        name: of the file.
        volts: at the motor, V: duty times supply.
        duty: size of the duty; 1 where the command is volts. The current of the supply is that of the motor times it.
        thrust: N, positive forward.
        current: A, of the supply, with the sign of the command.
        speed: rad/s, with the sign of the command.
        supply: V; the largest volts where the command is volts.
        time: s; None of settled rows.
        notes: what was done to the numbers, in words.
    """

    name: str
    volts: Rows
    duty: Rows
    thrust: Rows
    current: Rows
    speed: Rows
    supply: Rows
    time: Rows | None = None
    notes: tuple[str, ...] = ()

    def has(self, quantity: str) -> bool:
        """Whether one of `MEASURED` was."""
        return bool(np.isfinite(getattr(self, quantity)).any())

    def rows(self, chosen: np.ndarray) -> "BenchTable":
        """Some of the rows: indices, or True for each one."""
        names = ("volts", "duty", "thrust", "current", "speed", "supply")
        arrays = {name: getattr(self, name)[chosen] for name in names}
        return self._replace(**arrays, time=None if self.time is None else self.time[chosen])
