"""Scenarios of controllers that drive a vehicle at the other end of a link."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from undertow.scenario.reading import Text, from_data, read


def read_for_link(path: Path, *, allow_code: bool = False, unsupervised: bool = False) -> Text:
    """A scenario with a supervisor, since one wrong message must not end control.

    Args:
        path: of the file.
        allow_code: whether the Python code that an earlier run.nc names may run.
        unsupervised: whether the controller is supervised only where the scenario says so.

    Raises:
        BadInput: as of `read`.
    """
    text = read(path, allow_code=allow_code)
    if unsupervised or text.data.get("supervisor"):
        return text
    return text._replace(data=text.data | {"supervisor": True})


def text_of(scenario: str | Path | Mapping[str, Any] | Text, allow_code: bool = False) -> Text:
    """A scenario, given as a file, as a mapping, or as read.

    Raises:
        BadInput: as of `read`.
    """
    if isinstance(scenario, Text):
        return scenario
    return from_data(scenario) if isinstance(scenario, Mapping) else read(Path(scenario), allow_code=allow_code)


def at_sampling_time(text: Text, sampling_time: float | None) -> Text:
    """The scenario with another time between control steps, for which rules choose gains then.

    Args:
        text: of the scenario.
        sampling_time: s; None for that of the scenario.
    """
    loop = text.data.get("loop") or {}
    if sampling_time is None or not isinstance(loop, Mapping):
        return text
    # Nothing is recorded, but a time between records must be a multiple of that between steps.
    steps = {"dt": float(sampling_time), "record": float(sampling_time)}
    return text._replace(data=text.data | {"loop": dict(loop) | steps})
