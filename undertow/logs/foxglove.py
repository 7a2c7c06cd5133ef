"""Messages that Foxglove shows in three dimensions: transforms of the vehicle, its hull, its path.

Schemas: docs.foxglove.dev/docs/sdk/schemas. Foxglove's axes point up: frame `world` is east, north, up, and `ned`
within it is ours.

`foxglove-sdk` has these schemas too, but in a library of 54 MB that encodes Protobuf only. Here they take sixty lines,
and the whole log stays JSON, which readers without Protobuf understand. The fields are those of
foxglove-schemas-protobuf 0.4.0, without exception.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from undertow.logs.frames import quaternions

WORLD, NED, VEHICLE, REFERENCE = "world", "ned", "vehicle", "reference"

# Quaternion x, y, z, w: half a turn about the diagonal of north and east.
_NED_IN_WORLD = (2**-0.5, 2**-0.5, 0.0, 0.0)

_SIZE = (0.5, 0.4, 0.3)  # m, of a vehicle whose size is unknown
_POINTS = 2000  # of the path, at most

# Written for every record of a run: a template takes a fifth of the time of `json.dumps`.
_TRANSFORM = (
    '{"timestamp": {"sec": %d, "nsec": %d}, "parent_frame_id": "%s", "child_frame_id": "%s", '
    '"translation": {"x": %r, "y": %r, "z": %r}, "rotation": {"x": %r, "y": %r, "z": %r, "w": %r}}'
)

_NUMBER = {"type": "number"}
_TIME = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0}},
}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _several(item: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": item}


_TEXT = {"type": "string"}
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE = _object(position=_VECTOR, orientation=_QUATERNION)
_CUBE = _object(pose=_POSE, size=_VECTOR, color=_COLOUR)
_LINE = _object(
    type={"type": "integer"},
    pose=_POSE,
    thickness=_NUMBER,
    scale_invariant={"type": "boolean"},
    points=_several(_VECTOR),
    color=_COLOUR,
    colors=_several(_COLOUR),
    indices=_several({"type": "integer"}),
)
_NONE = _several({"type": "object"})
_ENTITY = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_TIME | {"title": "duration"},
    frame_locked={"type": "boolean"},
    metadata=_several(_object(key=_TEXT, value=_TEXT)),
    arrows=_NONE,
    cubes=_several(_CUBE),
    spheres=_NONE,
    cylinders=_NONE,
    lines=_several(_LINE),
    triangles=_NONE,
    texts=_NONE,
    models=_NONE,
)

_FRAME = _object(
    timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_QUATERNION
)

SCHEMAS = {
    "foxglove.FrameTransforms": _object(transforms=_several(_FRAME)),
    "foxglove.SceneUpdate": _object(deletions=_NONE, entities=_several(_ENTITY)),
}


def nanoseconds(time: float) -> int:
    """A time in s as MCAP has it; times before zero, which it cannot have, become zero."""
    return max(0, round(time * 1e9))


def transforms(time: np.ndarray, motions: Mapping[str, np.ndarray]) -> Iterator[tuple[float, bytes]]:
    """Time and `foxglove.FrameTransforms` of each sample: our axes in the world's, and frames that move in ours.

    Args:
        time: s.
        motions: rows north, east, down (m), roll, pitch, yaw (rad) of each frame; rows not finite are left out.
    """
    parts = []
    for outputs in motions.values():
        is_finite = np.atleast_1d(np.isfinite(outputs).all(axis=1))
        attitudes = quaternions(outputs[:, 3:])[:, [1, 2, 3, 0]].tolist()
        parts.append(zip(is_finite, outputs[:, :3].tolist(), attitudes, strict=True))
    for when, *frames in zip(time.tolist(), *parts, strict=True):
        stamp = divmod(nanoseconds(when), 10**9)
        messages = [_TRANSFORM % (*stamp, WORLD, NED, 0, 0, 0, *_NED_IN_WORLD)]
        for name, (is_finite, position, quaternion) in zip(motions, frames, strict=True):
            if is_finite:
                messages.append(_TRANSFORM % (*stamp, NED, name, *position, *quaternion))
        yield when, f'{{"transforms": [{", ".join(messages)}]}}'.encode()


def scene(time: float, path: np.ndarray, size: Any = None) -> bytes:
    """`foxglove.SceneUpdate` with the hull as a box, and the path.

    Args:
        time: s.
        path: rows north, east, down, m; none for no path.
        size: length, width and height of the vehicle, m; None for a usual one.
    """
    box = {"pose": _pose(), "size": _vector(_SIZE if size is None else size), "color": _colour(0.0, 0.45, 0.7, 0.8)}
    entities = [_entity(time, VEHICLE, "hull", cubes=[box])]
    points = path[np.isfinite(path).all(axis=1)][:: 1 + len(path) // _POINTS]
    if len(points) > 1:
        line = {
            "type": 0,  # a strip
            "pose": _pose(),
            "thickness": 2.0,
            "scale_invariant": True,
            "points": [_vector(point) for point in points],
            "color": _colour(0.88, 0.48, 0.0, 1.0),
            "colors": [],
            "indices": [],
        }
        entities.append(_entity(time, NED, "path", lines=[line]))
    return json.dumps({"deletions": [], "entities": entities}, allow_nan=False).encode()


def _entity(time: float, frame: str, name: str, **shapes: Any) -> dict[str, Any]:
    kinds = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    header = {"timestamp": _stamp(time), "frame_id": frame, "id": name, "lifetime": {"sec": 0, "nsec": 0}}
    return header | {"frame_locked": True, "metadata": []} | {kind: [] for kind in kinds} | shapes


def _stamp(time: float) -> dict[str, int]:
    seconds, remainder = divmod(nanoseconds(time), 10**9)
    return {"sec": seconds, "nsec": remainder}


def _pose() -> dict[str, Any]:
    return {"position": _vector((0, 0, 0)), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def _vector(values: Any) -> dict[str, float]:
    x, y, z = map(float, values)
    return {"x": x, "y": y, "z": z}


def _colour(red: float, green: float, blue: float, alpha: float) -> dict[str, float]:
    return {"r": red, "g": green, "b": blue, "a": alpha}
