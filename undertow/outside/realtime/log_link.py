"""A recorded log as a link: what the controller was given then goes in again, and the commands are compared."""

from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import AbstractPlant, Target
from undertow.core.errors import BadInput
from undertow.logs.log import Log
from undertow.logs.read import read_log
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.realtime.link import AbstractLink, LinkMeasurement

_HINT = "Give the run.mcap of `undertow run`, or a log that `Autopilot` wrote"


class Difference(NamedTuple):
    """Departure of the commands of a replay from those of the log, of one actuator.

    Attributes:
        actuator: name.
        steps: number of steps whose command differs in any bit.
        first: time of the first of them, s; NaN without one.
        largest: largest absolute difference, in the unit of the input.
    """

    actuator: str
    steps: int
    first: float
    largest: float


class LogLink(AbstractLink):
    """Steps of a log, one after the other. The log is not changed.

    Args:
        path: .mcap file that an autopilot wrote.
        plant: of the scenario that is replayed.

    Attributes:
        sampling_time: s, of the autopilot that wrote the log.
        precision: of it.
        notes: what the reader of the file says of it, such as that its end is missing.

    Raises:
        BadInput: the file is damaged, or has not what a replay needs, or belongs to another plant.
    """

    def __init__(self, path: Path, plant: AbstractPlant):
        log = read_log(path)
        if not isinstance(log, Log) or "elapsed" not in log:
            raise BadInput("--link", "name a log that holds what a controller received", str(path), hint=_HINT)
        self.sampling_time, self.form, self.precision = _facts(log, path)
        self.notes = log.notes
        self._plant, self._log = plant, log
        names = ["received_position", "received_velocity"] + ["received_attitude"] * (self.form is not None)
        targets = ["reference", "reference_velocity", "reference_acceleration"]
        optional = [name for name in ("received_report", "received_health") if name in log]
        used = [*names, *targets, *optional, "applied_input", "elapsed", "commanded_input"]
        steps = self._whole_steps(log, used, path)
        rows = {name: log[name].values[:steps] for name in used}
        self._motion, self._target = [rows[name] for name in names], [rows[name] for name in targets]
        self._applied, self._elapsed, self._expected = rows["applied_input"], rows["elapsed"], rows["commanded_input"]
        self._health = rows.get("received_health")
        self._time = log["elapsed"].time[:steps]
        self._reports = self._split(rows["received_report"]) if "received_report" in rows else None
        self._found = np.full_like(self._expected, np.nan)
        self._row = self._answered = 0
        self._check(path)

    def _whole_steps(self, log: Log, names: list[str], path: Path) -> int:
        """Number of steps of which the log has everything: the end of the process may have cut the last one."""
        steps = min(len(log[name].time) for name in names)
        if not steps or any((log[name].time[:steps] != log["elapsed"].time[:steps]).any() for name in names):
            raise BadInput("--link", "name a log whose steps are whole", str(path), hint=_HINT)
        return steps

    def _split(self, rows: np.ndarray) -> list[np.ndarray]:
        """Reports of each kind, which stand one behind the other in a row."""
        plant = self._plant
        shapes = jax.eval_shape(lambda: plant.output(jnp.zeros(()), plant.initial_state()).actuator)
        sizes = [int(np.prod(leaf.shape)) for leaf in jax.tree.leaves(shapes)]
        return np.split(rows, np.cumsum(sizes)[:-1], axis=1)

    def _check(self, path: Path) -> None:
        if self._expected.shape[1:] != (self._plant.inputs(),):
            got = f"{path}, of {self._expected.shape[1]}"
            raise BadInput("--link", f"name a log of {self._plant.inputs()} actuators, as the scenario has", got)
        if self._elapsed[0] != 0:
            raise BadInput("--link", "name a log that begins with the start of the controller", str(path), hint=_HINT)

    def receive(self, elapsed: float) -> LinkMeasurement | None:
        k = self._row
        self._row += 1
        if k >= len(self._time):
            self.ended = "the log ended"
            return None
        motion = [values[k] for values in self._motion]
        applied = None if np.isnan(self._applied[k]).all() else self._applied[k]
        return LinkMeasurement(
            *motion,
            propellers=None if self._reports is None else tuple(report[k] for report in self._reports),
            health=None if self._health is None else self._health[k],
            applied=applied,
            target=Target(*(values[k] for values in self._target)),
            elapsed=float(self._elapsed[k]),
        )

    def send(self, command: np.ndarray) -> None:
        if self._answered < len(self._found):
            self._found[self._answered] = command
        self._answered += 1

    def finish(self, safe: np.ndarray) -> None:
        """The log is not changed: there is nothing to send."""

    def counts(self) -> dict[str, int]:
        return {"steps of the log": len(self._time), "replayed": min(self._answered, len(self._time))}

    def differences(self) -> list[Difference]:
        """Departures of the commands, per actuator that has one; empty where all bits are equal.

        Steps of the log that were not replayed do not count.
        """
        steps = min(self._answered, len(self._time))
        expected, replayed = self._expected[:steps], self._found[:steps]
        names = self._log["commanded_input"].column_names()
        columns = []
        for i, name in enumerate(names):
            differs = expected[:, i] != replayed[:, i]
            if differs.any():
                largest = float(np.abs(expected[:, i] - replayed[:, i]).max())
                columns.append(Difference(name, int(differs.sum()), float(self._time[np.argmax(differs)]), largest))
        return columns


def _facts(log: Log, path: Path) -> tuple[float, Format | None, str]:
    """Sampling time, format and precision of the autopilot that wrote a log."""
    try:
        period = float(log.facts["sampling_time"].removesuffix(" s"))
        form = Format(log.facts["attitude"], log.facts["velocity"])
        precision = log.facts["precision"]
        if not 0 < period < np.inf:
            raise ValueError
    except (KeyError, ValueError):
        raise BadInput("--link", "name a log that says how it was sampled", str(path), hint=_HINT) from None
    if form.attitude == "":
        return period, None, precision
    form.check()
    return period, form, precision
