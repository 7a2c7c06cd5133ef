"""Writes logs as MCAP: JSON messages with a schema, in chunks, which Foxglove opens and `read_mcap` reads back.

The package `mcap` is imported by the functions that write.
"""

import contextlib
import heapq
import itertools
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.logs import foxglove
from undertow.logs.log_signals import LogSignals, Series
from undertow.logs.messages import MessageForm, grouped
from undertow.logs.motion import at_times, without_jumps

METADATA = "undertow"  # name of the record with the facts of a log

_CHUNK, _LIVE_CHUNK = 2**20, 2**14  # bytes of a chunk

_LATEST = 2.0**63 * 1e-9  # s, times of a file


class _Writer:
    """An MCAP file that is being written."""

    def __init__(self, stream: IO[bytes], chunk: int, facts: Mapping[str, str]):
        from mcap.writer import Writer

        self._stream = stream
        self._writer = Writer(stream, chunk_size=chunk)
        self._ids = {}
        self._writer.start(profile="", library="undertow")
        self._writer.add_metadata(METADATA, {key: str(value) for key, value in facts.items()})

    def channel(self, topic: str, schema_name: str, schema: str) -> int:
        """Number of a new channel."""
        if schema_name not in self._ids:
            self._ids[schema_name] = self._writer.register_schema(schema_name, "jsonschema", schema.encode())
        return self._writer.register_channel(topic, "json", self._ids[schema_name])

    def foxglove_channel(self, topic: str, schema_name: str) -> int:
        return self.channel(topic, schema_name, json.dumps({"title": schema_name} | foxglove.SCHEMAS[schema_name]))

    def write(self, channel: int, time: float, message: bytes) -> None:
        stamp = foxglove.nanoseconds(time)
        self._writer.add_message(channel, stamp, message, stamp)

    def end_chunk(self) -> None:
        """Write the messages of the chunk that is not full, which `mcap` does at the end only."""
        self._writer._Writer__finalize_chunk()  # type: ignore[attr-defined] - `mcap` has no public name for it
        self._stream.flush()

    def note(self, text: str) -> None:
        """Write a note about the recording, which readers show."""
        self._writer.add_metadata(METADATA, {"notes": text})

    def finish(self) -> None:
        """Write the index, without which the file can be read too."""
        self._writer.finish()
        self._stream.flush()


def write_mcap(log: LogSignals, path: Path, size: Any = None) -> None:
    """Write a log to a file.

    Args:
        log: with the signals.
        path: of the file, which is replaced.
        size: length, width and height of the vehicle, m, for the view in three dimensions; None for usual ones.

    Raises:
        BadInput: a time that the format cannot hold.
        OSError: the file cannot be written.
    """
    _check_times(log)
    with path.open("wb") as stream:
        facts = {"source": log.source, "format": log.format, "notes": "\n".join(log.notes)} | dict(log.facts)
        writer = _Writer(stream, _CHUNK, facts)
        streams = []
        for topic, signals in grouped(log.signals).items():
            form = MessageForm(topic.strip("/").replace("/", "."), signals)
            channel = writer.channel(topic, form.schema_name, form.schema())
            streams.append(zip(itertools.repeat(channel), form.of_samples()))
        # In the order of time, so that a viewer need not read the whole file for one moment.
        for channel, (time, message) in heapq.merge(*streams, *_view(writer, log, size), key=lambda entry: entry[1][0]):
            writer.write(channel, time, message)
        writer.finish()


def _check_times(log: LogSignals) -> None:
    """Check that all times can be written: as nanoseconds from 0 in 64 bits."""
    for name, series in log.signals.items():
        held = (series.time > -0.5e-9) & (series.time < _LATEST)
        if not held.all():
            got = f"{log.source}, whose {name} has {float(series.time[~held][0]):g} s"
            must = f"have times from 0 to {_LATEST:.4g} s to be written as MCAP"
            raise BadInput("log", must, got, hint="Write a .csv file instead")


def _view(writer: _Writer, log: LogSignals, size: Any) -> list[Iterable[tuple[int, tuple[float, bytes]]]]:
    """Channels and messages of the transforms and the scene, of a log that has the pose of a vehicle."""
    pose = pose_of(log.signals)
    if pose is None or not len(pose[0]):
        return []
    time, outputs = pose
    channel = writer.foxglove_channel("/tf", "foxglove.FrameTransforms")
    motions = {foxglove.VEHICLE: outputs}
    reference = log.signals.get("reference")
    if reference is not None and reference.values.shape == outputs.shape:
        motions[foxglove.REFERENCE] = reference.values
    view = writer.foxglove_channel("/scene", "foxglove.SceneUpdate")
    start = float(time[0])
    moving = zip(itertools.repeat(channel), foxglove.transforms(time, motions))
    return [[(view, (start, foxglove.scene(start, outputs[:, :3], size)))], moving]


def pose_of(signals: Mapping[str, Series]) -> tuple[np.ndarray, np.ndarray] | None:
    """Time and rows north, east, down, roll, pitch, yaw of a vehicle, measured ones without true ones; else None."""
    position = signals.get("position", signals.get("measured_position"))
    attitude = signals.get("attitude")
    if position is None or position.columns[:3] != ("north", "east", "down"):
        return None
    if position.values.shape[1:] == (6,):
        return position.time, position.values
    if attitude is None or not len(attitude.time) or not len(position.time):
        return None
    angles = at_times(position.time, attitude._replace(values=without_jumps(attitude.values)))
    return position.time, np.column_stack([position.values, angles])


def _pose_names(signals: Mapping[str, Series]) -> tuple[str, ...] | None:
    """Names of the signals that are the pose of a vehicle; None without them."""
    for names in (("position", "attitude"), ("position",), ("measured_position",)):
        columns = [column for name in names if name in signals for column in signals[name].columns]
        if columns == ["north", "east", "down", "roll", "pitch", "yaw"]:
            return names
    return None


class LiveLog:
    """A log of a controller that runs, written step by step; the recorder of a `BackgroundWriter`.

    Args:
        path: of the file, which is replaced.
        signals: whose columns, units and meanings the steps have; their samples do not matter.
        facts: text by name.

    Raises:
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, signals: Mapping[str, Series], facts: Mapping[str, str]):
        self._stream = path.open("wb")
        self._writer = _Writer(self._stream, _LIVE_CHUNK, dict(facts) | {"format": "undertow", "source": path.name})
        self._topics = []
        for topic, signals_of_topic in grouped(signals).items():
            form = MessageForm(topic.strip("/"), signals_of_topic)
            self._topics.append(
                (self._writer.channel(topic, form.schema_name, form.schema()), form, tuple(signals_of_topic))
            )
        self._tf = self._writer.foxglove_channel("/tf", "foxglove.FrameTransforms")
        self._pose = _pose_names(signals)
        self._begun = False

    def write(self, entry: tuple[float, Mapping[str, Any]]) -> None:
        """Write one step: its time, s, and the values of all signals by name."""
        time, values = entry
        for channel, form, names in self._topics:
            flat = np.concatenate([np.ravel(values[name]).astype(float) for name in names]).tolist()
            self._writer.write(channel, time, form.of_sample(time, flat))
        if self._pose is not None:
            outputs = np.concatenate([np.ravel(values[name]) for name in self._pose])
            if np.isfinite(outputs).all():
                self._view(time, outputs)

    def flush(self) -> None:
        """Bring all steps to the disk: they survive `kill -9` and a power cut."""
        self._writer.end_chunk()
        os.fsync(self._stream.fileno())

    def _view(self, time: float, pose: np.ndarray) -> None:
        if not self._begun:
            scene = self._writer.foxglove_channel("/scene", "foxglove.SceneUpdate")
            self._writer.write(scene, time, foxglove.scene(time, np.zeros((0, 3))))
            self._begun = True
        for when, message in foxglove.transforms(np.array([time]), {foxglove.VEHICLE: pose[None]}):
            self._writer.write(self._tf, when, message)

    def close(self, dropped: int = 0) -> None:
        """Write the end of the file; nothing may be written afterwards.

        Args:
            dropped: steps that are missing.

        Raises:
            OSError: it cannot be written; the file is closed all the same.
        """
        if not self._stream.closed:
            try:
                if dropped:
                    self._writer.note(f"{dropped} steps are missing: the disk was too slow")
                self._writer.finish()
                os.fsync(self._stream.fileno())
            finally:
                self.abandon()

    def abandon(self) -> None:
        """Close the file without its end."""
        with contextlib.suppress(OSError):
            self._stream.close()
