"""Scenarios of controllers that drive a vehicle at the other end of a link."""

from pathlib import Path

from undertow.scenario.reading import Text, read


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
