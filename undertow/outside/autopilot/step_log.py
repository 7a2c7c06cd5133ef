"""Writes every step of an autopilot or a navigation filter to an MCAP file."""

import itertools
import warnings
import weakref
from collections.abc import Mapping
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.core.contracts import AbstractController, AbstractPlant, Target
from undertow.core.errors import BadInput
from undertow.core.signals import Signal
from undertow.logs.background_writer import BackgroundWriter
from undertow.logs.known_signals import SIGNALS, thruster_columns
from undertow.logs.log_signals import Series
from undertow.logs.mcap_writer import LiveLog
from undertow.outside.autopilot.measured_motion import Format, MeasuredMotion

_STEPS = {
    "measured_position": Signal(("axis",), "[axis]", "position that the controller receives"),
    "measured_velocity": Signal(("axis",), "[axis]/s", "velocity that the controller receives"),
    "reference": Signal(("axis",), "[axis]", "desired position x_d"),
    "commanded_input": Signal(("actuator",), "[input]", "input commanded"),
}

_RECEIVED = {
    "received_position": Signal(("axis",), "[axis]", "position as it was given"),
    "received_attitude": Signal(("axis",), "1", "attitude as it was given"),
    "received_velocity": Signal(("axis",), "[axis]/s", "velocity as it was given"),
    "received_report": Signal((), "1", "reports of the actuators as they were given"),
    "received_health": Signal(("actuator",), "1", "1, or 0 of an actuator that announced that it has failed"),
    "reference_velocity": Signal(("axis",), "[axis]/s", "desired velocity"),
    "reference_acceleration": Signal(("axis",), "[axis]/s^2", "desired acceleration"),
    "applied_input": Signal(("actuator",), "[input]", "input applied since the last step"),
    "elapsed": Signal((), "s", "time since the last step; 0 at a start"),
}


class ReceivedStep(NamedTuple):
    """What a step was given, as it was given: from a log that holds it, the step can be repeated bit for bit.

    Attributes:
        motion: as measured, in the format of the autopilot.
        actuator: what the actuators reported; a tree of arrays, or None.
        target: to follow.
        health: of the actuators, or None.
        applied: input applied since the last step; NaN at a start without one.
        elapsed: time since the last step, s; 0 at a start.
    """

    motion: MeasuredMotion
    actuator: Any
    target: Target
    health: Any
    applied: Any
    elapsed: float

    def numbers(self) -> dict[str, Any]:
        """The numbers by name of the signal; reports of several kinds one behind the other."""
        numbers_by_name = {
            f"received_{name}": value for name, value in zip(MeasuredMotion._fields, self.motion, strict=True)
        }
        reports = jax.tree.leaves(self.actuator)
        if reports:
            numbers_by_name["received_report"] = np.concatenate([np.ravel(report) for report in reports])
        if self.health is not None:
            numbers_by_name["received_health"] = self.health
        reference = {"reference_velocity": self.target.velocity, "reference_acceleration": self.target.acceleration}
        numbers_by_name |= reference | {"applied_input": self.applied, "elapsed": self.elapsed}
        return {name: value for name, value in numbers_by_name.items() if np.size(value)}


class StepLog:
    """A log of steps, written in a thread of its own. It ends when its owner does; `kill -9` costs the last second.

    Where the file cannot be written any more, a warning says so once, and the owner goes on. Where the disk is too slow
    for the owner, steps are dropped and counted. A step waits for the disk only while the owner is ahead of real time:
    a loop with a simulated clock loses nothing.
    Where the time of the owner goes back, as after another `start`, that of the log goes on.

    Args:
        path: of the file, whose name ends in .mcap. Where there is one already, as after a restart, a number is added:
            flight-2.mcap.
        signals: by name, with values of the right shape.
        period: sampling time, s.
        owner: with whose end the file is finished.
        facts: text by name that the file keeps.

    Attributes:
        path: of the file that is written.

    Raises:
        BadInput: the file cannot be written.
    """

    def __init__(
        self,
        path: str | Path,
        signals: Mapping[str, Series],
        period: float,
        owner: Any,
        facts: Mapping[str, str] | None = None,
    ):
        path = _free(Path(path))
        self.path = path
        self._period = period
        self._offset = 0.0
        self._last = -np.inf
        if path.suffix != ".mcap":
            raise BadInput("log", "be a file whose name ends in .mcap", str(path))
        facts = {"sampling_time": f"{period!r} s"} | dict(facts or {})
        try:
            self._writer = BackgroundWriter(lambda: LiveLog(path, signals, facts))
        except OSError as error:
            raise BadInput("log", "be a file that can be written", f"{path}: {error.strerror}") from None
        self._began: float | None = None  # when time zero of the log was, s by the monotonic clock
        self.close = weakref.finalize(owner, _close, self._writer, path)

    @property
    def dropped(self) -> int:
        """Steps that are missing because the disk was too slow."""
        return self._writer.dropped

    def append(self, time: float, values: Mapping[str, Any]) -> None:
        """Write the values of a step at a time, s; nothing after `close`."""
        if not self.close.alive:
            return
        if time + self._offset <= self._last:
            self._offset = self._last + self._period - time
        self._last = time + self._offset
        if self._writer.failure:  # a full disk does not stop the controller
            self.close()
            return
        now = monotonic()
        if self._began is None:
            self._began = now - self._last
        entry = self._last, {name: np.array(value) for name, value in values.items()}  # the next step overwrites them
        self._writer.put(entry, patience=self._began + self._last - now)


def _free(path: Path) -> Path:
    """The path, or, where a file is there, the next one with a number at which there is nothing."""
    numbered = (path.with_stem(f"{path.stem}-{i}") for i in itertools.count(2))
    return next(candidate for candidate in numbered if not candidate.exists()) if path.is_file() else path


def _close(writer: BackgroundWriter, path: Path) -> None:
    """Finish a log; what is missing in it is a warning."""
    writer.close()
    for sentence in writer.missing("steps"):
        warnings.warn(f"{path}: {sentence}", stacklevel=2)


def law_signals(
    plant: AbstractPlant, law: AbstractController, declared: Mapping[str, Signal], values: Mapping[str, Any]
) -> dict[str, Series]:
    """What an autopilot writes: what it measured, the target, its command, and the signals of the law.

    Args:
        plant: that is controlled.
        law: the controller.
        declared: signals of the law.
        values: examples of them.
    """
    outputs = plant.outputs
    inputs = thruster_columns(plant.inputs())
    axes = law.model.coordinates.axes or outputs
    series = {}
    for name, signal in (_STEPS | dict(declared)).items():
        ours = name in _STEPS
        first = next(iter(signal.dimensions), "")
        shape = (len(inputs if first == "actuator" else outputs),) if ours else np.shape(values[name])
        columns = {"axis": outputs if ours else axes, "actuator": inputs}.get(first, ())
        unit = signal.unit_for(plant.output_units, plant.input_unit)
        series[name] = Series(np.zeros(1), np.zeros((1, *shape)), columns, unit, signal.meaning)
    return series


def received_signals(plant: AbstractPlant, form: Format | None, numbers: Mapping[str, Any]) -> dict[str, Series]:
    """What an autopilot writes of what it was given: enough to repeat the step.

    Args:
        plant: that is controlled.
        form: of the measured motion; None for a plant that is no vehicle.
        numbers: examples, of `ReceivedStep.numbers`.
    """
    outputs = plant.outputs
    inputs = thruster_columns(plant.inputs())
    names = MeasuredMotion(outputs, (), outputs) if form is None else form.columns()
    columns = {
        f"received_{name}": column_names for name, column_names in zip(MeasuredMotion._fields, names, strict=True)
    }
    columns |= dict.fromkeys(("reference_velocity", "reference_acceleration"), outputs)
    columns |= dict.fromkeys(("received_health", "applied_input"), inputs)
    make_series = lambda name, value: Series(
        np.zeros(1),
        np.zeros((1, *np.shape(value))),
        columns.get(name, ()),
        _RECEIVED[name].unit_for(plant.output_units, plant.input_unit),
        _RECEIVED[name].meaning,
    )
    return {name: make_series(name, value) for name, value in numbers.items()}


def filter_signals(declared: Mapping[str, Signal], values: Mapping[str, Any]) -> dict[str, Series]:
    """What a navigation filter writes: the estimated motion, and its signals.

    Args:
        declared: signals of the filter.
        values: examples of them.
    """
    motion = {name: SIGNALS[name] for name in ("position", "attitude", "body_velocity", "angular_velocity")}
    series = {
        name: Series(
            np.zeros(1),
            np.zeros((1, len(known_signal.columns))),
            known_signal.columns,
            known_signal.unit,
            f"estimated {known_signal.meaning}",
        )
        for name, known_signal in motion.items()
    }
    for name, signal in declared.items():
        unit = signal.unit_for(("m", "rad"), "")
        series[name] = Series(np.zeros(1), np.asarray(values[name])[None], (), unit, signal.meaning)
    return series
