"""Figure of a comparison: paths in the horizontal plane, a panel for each controller, all on one scale."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from undertow.core.status import Status
from undertow.report.figures import style
from undertow.report.figures.campaign import looks_of
from undertow.studies.campaign.store_layout import SAMPLES
from undertow.studies.comparison.findings import Findings

PLANE = ("north", "east")

_ABREAST = 4  # panels in a row
_WIDTH, _LEFT, _GAP, _HEAD, _BELOW, _TALLEST = 9.6, 0.72, 0.7, 0.5, 0.75, 3.2  # in; the last is of a panel
_MARGIN, _NARROWEST = 1.12, 0.5  # times the extent of the paths; ratio of the sides of a panel
_ENLARGED = 0.3  # share of the whole extent below which the second half is shown once more


class _Path(NamedTuple):
    """A path until the run ended: east and north, m, shape (records, 2)."""

    name: str
    colour: str
    points: np.ndarray
    completed: bool


class _View(NamedTuple):
    """What panels show of the plane, and how large they are."""

    words: str
    part: np.ndarray  # of the records, (time,)
    low: np.ndarray  # m, (2,)
    span: np.ndarray  # m, (2,)

    def sides(self, paths: int) -> np.ndarray:
        """Width and height of a panel, in, of so many."""
        room = (_WIDTH - _LEFT + _GAP) / min(paths, _ABREAST) - _GAP, _TALLEST
        return self.span * min(room / self.span)


def plan_figure(dataset: xr.Dataset, findings: Findings) -> Figure:
    """Path of the first trial of each controller and the reference, on axes that fit the completed runs.

    Where the second half of the run takes up little of the whole, it follows on a larger scale.
    """
    time = dataset["time"].values
    paths = [
        _path(dataset, findings, i, name, look.colour)
        for i, (name, look) in enumerate(looks_of(findings.names).items())
    ]
    desired = _points(dataset["series:reference"].isel({findings.dimension: 0, SAMPLES: 0}))
    completed = [candidate for candidate in paths if candidate.completed]
    point_sets = [candidate.points for candidate in completed or paths]
    views = [_view("whole run", np.ones(len(time), bool), [*point_sets, desired])]
    second_half = _view(f"{time[-1] / 2:g} to {time[-1]:g} s", time >= time[-1] / 2, [*point_sets, desired])
    views += [second_half] if second_half.span.max() < _ENLARGED * views[0].span.max() else []
    figure, corners_of_views = _laid_out(views, len(paths))
    style.head(figure, "Paths in the horizontal plane, first trial", {"reference": style.TRUTH})
    for view, corners in zip(views, corners_of_views, strict=True):
        for path, corner in zip(paths, corners, strict=True):
            panel = style.place(figure, *corner, *view.sides(len(paths)))
            panel.plot(*path.points[view.part[: len(path.points)]].T, color=path.colour, linewidth=0.9)
            if not path.completed:
                panel.plot(*path.points[-1:].T, "x", color=path.colour, markersize=7)
            panel.plot(*desired[view.part].T, **style.TRUTH.line)
            panel.plot(*desired[-1:].T, "o", color=style.INK, markersize=3, zorder=style.TRUTH.order)
            panel.set_xlim(view.low[0], view.low[0] + view.span[0])
            panel.set_ylim(view.low[1], view.low[1] + view.span[1])
            panel.ticklabel_format(useOffset=False)
            style.label(panel, "east, m", "north, m", f"{path.name}, {view.words}")
    return figure


def _laid_out(views: list[_View], paths: int) -> tuple[Figure, list[list[tuple[float, float]]]]:
    """An empty figure, and the left upper corner of each panel, in: the views beside each other where there is room."""
    across = min(paths, _ABREAST)
    left, top = _LEFT, _HEAD
    corners_of_views, bottom = [], _HEAD
    for view in views:
        width, height = view.sides(paths)
        if left > _LEFT and (left + across * (width + _GAP) - _GAP > _WIDTH or paths > across):
            left, top = _LEFT, bottom
        cells = [divmod(i, across) for i in range(paths)]
        corners_of_views.append(
            [(left + column * (width + _GAP), top + row * (height + _BELOW)) for row, column in cells]
        )
        left += across * (width + _GAP)
        bottom = max(bottom, top + (cells[-1][0] + 1) * (height + _BELOW))
    return style.blank(_WIDTH, bottom - 0.2), corners_of_views


def _points(position: xr.DataArray) -> np.ndarray:
    return position.sel(axis=list(PLANE[::-1])).transpose("time", "axis").values


def _path(dataset: xr.Dataset, findings: Findings, i: int, name: str, colour: str) -> _Path:
    row = dataset.isel({findings.dimension: i, SAMPLES: 0})
    valid_positions = row["series:position"].isel(time=row["time"].values <= float(row["ended"]))
    return _Path(name, colour, _points(valid_positions), int(row["status"]) == int(Status.OK))


def _view(words: str, part: np.ndarray, lines: list[np.ndarray]) -> _View:
    points = np.concatenate([line[part[: len(line)]] for line in lines])
    low, high = points.min(axis=0), points.max(axis=0)
    span = _MARGIN * (high - low)
    span = np.maximum(span, max(_NARROWEST * span.max(), 1e-6))
    return _View(words, part, (low + high - span) / 2, span)
