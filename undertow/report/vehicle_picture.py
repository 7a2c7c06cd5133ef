"""A vehicle with its thrusters, from above and from starboard, as one SVG element."""

import collections
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.report.page import Html
from undertow.report.replay.replay_data import hull_size
from undertow.report.svg import BLUE, GREY, picture, polyline, words

_WIDTH, _HEIGHT, _MARGIN, _TOP = 800, 320, 76, 30  # pixels
_ARROW, _HEAD, _DOT = 36.0, 7.0, 7.0  # pixels: length in full view, its head, and radius of one seen from its end
_NEAR = 4.0  # pixels between arrows that are plotted as one
_SIDEWAYS = 0.4  # component to the side from which on a name stands beside its arrow
_FACING = 0.9  # component along the line of sight from which on an arrow is seen from its end


class _View(NamedTuple):
    """A side of the vehicle: body axes to the right and down in the picture, and away from the eye, with its sign."""

    title: str
    right: int
    down: int
    away: int
    sign: float


# Both with the bow to the right: from above, the eye looks along down; from starboard, it looks to port.
_VIEWS = (_View("from above", 0, 1, 2, 1.0), _View("from starboard", 0, 2, 1, -1.0))


def vehicle_picture(vehicle: VehicleModel) -> Html:
    """Hull, thrusters and the direction of their positive thrust, in equal scales; the bow is at the right.

    Args:
        vehicle: with known numbers. A hull of unknown size is the even box of the same mass and inertia.
    """
    size = hull_size(vehicle, None if vehicle.size is None else np.asarray(vehicle.size).tolist())
    positions = np.asarray(vehicle.thruster_positions, float)
    directions = np.asarray(vehicle.thruster_directions, float)
    center = np.asarray(vehicle.r_g, float)
    reach = np.maximum(size / 2, np.abs(positions - center).max(0))
    panel_width = (_WIDTH - 3 * _MARGIN) / 2
    scale = min(panel_width / (2 * reach[0]), (_HEIGHT - _TOP - 1.4 * _MARGIN) / (2 * max(reach[1], reach[2])))
    parts: list[Html] = []
    for number, view in enumerate(_VIEWS):
        middle = np.array([_MARGIN + panel_width / 2 + number * (panel_width + _MARGIN), (_TOP + _HEIGHT) / 2])
        axes = [view.right, view.down]
        half = scale * size[axes] / 2
        parts += [words(float(middle[0]), 18, f"{view.title}, bow to the right", "middle"), _hull(middle, half)]
        points = middle + scale * (positions - center)[:, axes]
        parts += _thrusters(points, directions, view)
    return picture(_WIDTH, _HEIGHT, *parts)


def _hull(middle: Float[np.ndarray, "2"], half: Float[np.ndarray, "2"]) -> Html:
    left, top = middle - half
    width, height = 2 * half
    box = f'x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" rx="4"'
    return Html(f'<rect {box} fill="#eef4f8" stroke="{GREY}"/>')


def _thrusters(points: Float[np.ndarray, "N 2"], directions: Float[np.ndarray, "N 3"], view: _View) -> list[Html]:
    """An arrow along positive thrust for each; those that cover each other share it."""
    seen = directions[:, [view.right, view.down]]
    along_sight = -view.sign * directions[:, view.away]
    towards = np.where(np.abs(along_sight) > _FACING, np.sign(along_sight), 0.0)
    looks = np.round(np.column_stack([points / _NEAR, 4 * seen, towards])).astype(int).tolist()
    sharing: dict[tuple[int, ...], list[int]] = collections.defaultdict(list)
    for number, look in enumerate(looks):
        sharing[tuple(look)].append(number)
    parts = []
    for numbers in sharing.values():
        first, names = numbers[0], ", ".join(f"T{number + 1}" for number in numbers)
        if towards[first]:
            parts.append(_from_its_end(points[first], names, towards[first] > 0))
        else:
            parts.append(_arrow(points[first], names, seen[first]))
    return parts


def _arrow(point: Float[np.ndarray, "2"], names: str, seen: Float[np.ndarray, "2"]) -> Html:
    """From a thruster along what is seen of its thrust, with its name beyond the tip."""
    tip = point + _ARROW * seen
    along = seen / np.linalg.norm(seen)
    across = np.array([-along[1], along[0]])
    head = [tip - _HEAD * (along + side * across / 2) for side in (-1, 1)]
    corners = [point, tip, head[0], tip, head[1]]
    dot = f'<circle cx="{point[0]:.1f}" cy="{point[1]:.1f}" r="3" fill="{BLUE}"/>'
    anchor = "start" if along[0] > _SIDEWAYS else "end" if along[0] < -_SIDEWAYS else "middle"
    x, y = (float(value) for value in tip + 8 * along)
    name = words(x, y + 4 + 4 * float(along[1]), names, anchor)
    return Html(dot + polyline([(float(x), float(y)) for x, y in corners], BLUE) + name)


def _from_its_end(point: Float[np.ndarray, "2"], names: str, towards: bool) -> Html:
    """A ring with a dot where thrust points to the eye, with a cross where it points away; its name is above."""
    x, y = (float(value) for value in point)
    ring = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_DOT:g}" fill="#fff" stroke="{BLUE}" stroke-width="1.6"/>'
    ring += words(x, y - _DOT - 4, names, "middle")
    if towards:
        return Html(ring + f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2" fill="{BLUE}"/>')
    reach = _DOT / np.sqrt(2)
    strokes = [[(x - reach, y - side * reach), (x + reach, y + side * reach)] for side in (-1, 1)]
    return Html(ring + "".join(polyline(stroke, BLUE) for stroke in strokes))
