"""A video of a run, frame by frame with matplotlib and encoded by ffmpeg: plan view, side view, thrust and errors."""

import contextlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.ticker import FuncFormatter

from undertow.core.atomic_io import replacing
from undertow.core.errors import BadInput
from undertow.report.figures import style
from undertow.report.replay.replay_data import COLOURS, ReplayData, rotations

_RATE = 20  # frames per second
_LONGEST = 30.0  # s of video; a longer run is shown faster
_DOTS = 100  # per inch
_FAINT, _THRUST, _WATER, _ESTIMATE = "#9a9a9a", "#b3001b", "#1695a3", "#d1495b"
_WIDEST = 12.0  # half of a view in lengths of the vehicle; along a path that is longer it follows the vehicle
_MIDDLE = 0.6  # share of half a view: when the vehicle is farther from its centre, the view follows

_LEGEND = (("thrust", _THRUST), ("uncertainty", style.INK), ("estimate", _ESTIMATE), ("water", _WATER))

# One line through all edges of a box: its corners, some of them twice.
_EDGES = (
    np.array([[int(bit) for bit in f"{corner:03b}"] for corner in (0, 1, 3, 2, 0, 4, 5, 1, 5, 7, 3, 7, 6, 2, 6, 4)])
    - 0.5
)

# View -> components of (north, east, down) to the right and upwards, with the sign of the latter.
_VIEWS = {"plan view": (1, 0, 1.0), "side view": (0, 2, -1.0)}
_AXES = ("north, m", "east, m", "depth, m")


def check_video(path: Path, folder: Path, overwrite: bool) -> None:
    """Check, before anything is run, that a video can be written; `folder` will exist by then.

    Raises:
        BadInput: ffmpeg is missing, the name does not end in .mp4, its folder does not exist, or it would replace one.
    """
    if path.suffix != ".mp4":
        raise BadInput("--video", "be a file whose name ends in .mp4", str(path))
    if shutil.which("ffmpeg") is None:
        hint = (
            "Install it (Debian: apt-get install ffmpeg; macOS: brew install ffmpeg). run.html has a replay without it"
        )
        raise BadInput("--video", "be left out where ffmpeg is missing", "given", hint=hint)
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise BadInput("--video", "be in an existing folder", str(path))
    if path.exists() and not overwrite:
        raise BadInput("--video", "be a new file", f"{path}, which exists", hint="Add --overwrite to replace it")


def write_video(
    replay: ReplayData, path: Path, progress: Callable[[str, float], None] = lambda message, share: None
) -> None:
    """Write a run as MP4, in real time or so much faster that it lasts 30 s; the file appears whole or not at all.

    Args:
        replay: what is shown.
        path: of the file.
        progress: is given a message and the share done.

    Raises:
        OSError: the file cannot be written, or ffmpeg fails.
    """
    span = float(replay.time[-1] - replay.time[0])
    speed = max(1.0, span / _LONGEST)
    times = replay.time[0] + np.arange(0.0, span + 1e-9, speed / _RATE)
    frames = np.searchsorted(replay.time, times - 1e-9).clip(0, len(replay.time) - 1)
    scenes = _Scenes(replay, speed)
    with replacing(path) as file, _encoder(str(file), scenes.size()) as encode:
        for number, frame in enumerate(frames):
            encode(scenes.pixels(int(frame)))
            if number % _RATE == 0:
                progress("video", number / len(frames))
    progress("video", 1.0)


@contextlib.contextmanager
def _encoder(path: str, size: tuple[int, int]) -> Iterator[Callable[[bytes], object]]:
    """A function that adds a frame, RGBA, to a video; ffmpeg is stopped where the caller fails."""
    given = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", "{}x{}".format(*size), "-r", str(_RATE), "-i", "-"]
    made = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", path]
    command = ["ffmpeg", "-y", "-loglevel", "error", *given, *made]
    with tempfile.TemporaryFile() as says, subprocess.Popen(command, stdin=subprocess.PIPE, stderr=says) as process:
        assert process.stdin is not None
        try:
            yield process.stdin.write
        except BrokenPipeError:
            pass  # ffmpeg has ended, and says why
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait() != 0:
            says.seek(0)
            raise OSError(f"ffmpeg failed: {says.read().decode(errors='replace').strip()}")


class _Scenes:
    """The figure, and what moves in it."""

    def __init__(self, replay: ReplayData, speed: float):
        self.replay, self.speed = replay, speed
        self.figure = style.blank(12.8, 7.2)
        self.figure.dpi = _DOTS
        self.canvas = FigureCanvasAgg(self.figure)
        self.turns, self.ghosts = (rotations(replay.series[name]) for name in ("attitude", "desired_attitude"))
        self.shares = np.where(replay.series["thrust"] < 0, -1, 1) * _shares(replay)
        left = {"plan view": 3.75, "side view": 0.2}
        self.views = [
            _View(self._panel(0.7, 7.2 - bottom - 3.05, 6.0, 2.7, name), replay, name) for name, bottom in left.items()
        ]
        self._bars(
            self._panel(
                8.6, 0.6, 3.8, 2.4, "thrust, share of the limit" if replay.limited else "thrust, share of the largest"
            )
        )
        self.curves = self._errors(self._panel(7.8, 3.7, 4.6, 1.1, ""), self._panel(7.8, 5.2, 4.6, 1.1, ""))
        for number, (word, colour) in enumerate(_LEGEND):
            self.figure.text(0.62 + 0.085 * number, 0.03, word, fontsize=style.TEXT, color=colour)
        self.words = self.figure.text(0.62, 0.96, "", fontsize=11, color=style.INK)
        self.moving = [*self.bars, *self.curves, self.words, *(artist for view in self.views for artist in view.moving)]
        for artist in self.moving:
            artist.set_animated(True)
        self.still = None  # all that does not move, painted

    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.canvas.get_width_height()

    def _panel(self, left: float, top: float, width: float, height: float, title: str) -> Axes:
        panel = style.place(self.figure, left, top, width, height)
        panel.set_title(title, fontsize=style.TEXT, loc="left")
        return panel

    def _bars(self, panel: Axes) -> None:
        names = self.replay.thrusters.names
        self.bars = panel.barh(range(len(names)), np.zeros(len(names)), color=_THRUST)
        panel.set_yticks(range(len(names)), names)
        panel.set_xlim(-1, 1)
        panel.invert_yaxis()

    def _errors(self, position: Axes, attitude: Axes) -> list:
        time, error = self.replay.time, self.replay.series["error"]
        for panel, values, words in (
            (position, error[:, 0], "position error, m"),
            (attitude, error[:, 1], "attitude error, deg"),
        ):
            panel.plot(time, values, **style.SOLID.line)
            style.label(panel, "time, s" if panel is attitude else "", words)
        return [panel.axvline(time[0], color=_THRUST, linewidth=1.0) for panel in (position, attitude)]

    def pixels(self, frame: int) -> bytes:
        """The figure at a frame, RGBA. What does not move is painted once, or when a view has followed the vehicle."""
        replay, time = self.replay, self.replay.time[frame]
        followed = [view.show(frame, self.turns[frame], self.ghosts[frame], self.shares[frame]) for view in self.views]
        for bar, share in zip(self.bars, self.shares[frame], strict=True):
            bar.set_width(share)
        for line in self.curves:
            line.set_xdata([time, time])
        energy = replay.series["energy"][frame, 0]
        shown = "" if self.speed == 1 else f", shown {self.speed:.3g} times faster"
        self.words.set_text(f"{time:.1f} s of {replay.time[-1]:g} s{shown}. Energy {energy:.0f} J")
        if self.still is None or any(followed):
            self.canvas.draw()
            self.still = self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self.still)
        for artist in self.moving:
            (artist.axes or self.figure).draw_artist(artist)
        return bytes(self.canvas.buffer_rgba())


class _View:
    """Vehicle, reference, path and arrows from above or from the side."""

    def __init__(self, panel: Axes, replay: ReplayData, name: str):
        self.replay, self.panel = replay, panel
        self.right, self.up, self.sign = _VIEWS[name]
        self.longest = float(replay.size.max())
        self.ratio = panel.bbox.height / panel.bbox.width
        style.label(panel, _AXES[self.right], _AXES[self.up], name)
        if self.sign < 0:  # depth grows downwards
            panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{0.0 - value:g}"))
        panel.plot(*self._flat(replay.series["desired_position"]), color=_FAINT, linestyle="--", linewidth=1.0)
        (self.path,) = panel.plot([], [], **style.SOLID.line)
        (self.ghost,) = panel.plot([], [], color=_FAINT, linewidth=0.8)
        (self.hull,) = panel.plot([], [], color=COLOURS[0], linewidth=1.2)
        count = len(replay.thrusters.names)
        arrows = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "zorder": 5}
        self.thrust = panel.quiver(*np.zeros((4, count)), color=_THRUST, width=0.004, **arrows)
        self.loads = panel.quiver(*np.zeros((4, 3)), color=[_WATER, style.INK, _ESTIMATE], width=0.005, **arrows)
        self.moving = [self.path, self.ghost, self.hull, self.thrust, self.loads]
        self._frame_all()

    def _flat(self, points: np.ndarray) -> np.ndarray:
        """Points north, east, down as seen, shape (2, ...)."""
        return np.stack([points[..., self.right], self.sign * points[..., self.up]])

    def _frame_all(self) -> None:
        """Show all of the path, or as much of it as keeps the vehicle large."""
        both = self._flat(np.concatenate([self.replay.series["position"], self.replay.series["desired_position"]]))
        low, high = both.min(axis=1), both.max(axis=1)
        most = _WIDEST * self.longest
        needed = max(high[0] - low[0], (high[1] - low[1]) / self.ratio) / 2 + 1.2 * self.longest / self.ratio
        self.half, self.long = min(float(needed), most), needed > most
        self._look_at(both[:, 0] if self.long else (low + high) / 2)

    def _look_at(self, centre: np.ndarray) -> None:
        self.centre = centre
        self.panel.set_xlim(centre[0] - self.half, centre[0] + self.half)
        self.panel.set_ylim(centre[1] - self.half * self.ratio, centre[1] + self.half * self.ratio)

    def show(self, frame: int, turn: np.ndarray, ghost: np.ndarray, shares: np.ndarray) -> bool:
        """Move everything to a frame; whether the view has followed the vehicle."""
        series, corners = self.replay.series, _EDGES * self.replay.size
        position, thrusters = series["position"][frame], self.replay.thrusters
        self.path.set_data(*self._flat(series["position"][: frame + 1]))
        self.hull.set_data(*self._flat(position + corners @ turn.T))
        self.ghost.set_data(*self._flat(series["desired_position"][frame] + corners @ ghost.T))
        self.thrust.set_offsets(self._flat(position + thrusters.positions @ turn.T).T)
        along = 1.5 * self.longest * shares[:, None] * thrusters.directions
        self.thrust.set_UVC(*self._flat(along @ turn.T))
        self.loads.set_offsets(np.tile(self._flat(position), (3, 1)))
        self.loads.set_UVC(*self._flat(self._loads(frame, turn)))
        here = self._flat(position)
        away = bool((np.abs(here - self.centre) > _MIDDLE * self.half * np.array([1.0, self.ratio])).any())
        if follows := away and self.long:
            self._look_at(here)
        return follows

    def _loads(self, frame: int, turn: np.ndarray) -> np.ndarray:
        """Arrows of water, uncertainty and estimate: north, east, down; as long as the vehicle for a usual value."""
        replay, arrows = self.replay, np.zeros((3, 3))
        for row, (name, scaled_by) in enumerate(
            (("water", "water"), ("uncertainty", "uncertainty"), ("estimate", "uncertainty"))
        ):
            if name in replay.series:
                usual = np.quantile(np.linalg.norm(replay.series[scaled_by][:, :3], axis=1), 0.99)
                value = replay.series[name][frame, :3]
                inside = replay.body_axes and row > 0
                arrows[row] = (turn @ value if inside else value) / max(usual, 1e-9) * self.longest
        return arrows


def _shares(replay: ReplayData) -> np.ndarray:
    """Thrust as a share of the limit in its direction, shape (frames, N)."""
    thrust, limits = replay.series["thrust"], replay.thrusters.limits
    return np.abs(thrust) / np.abs(np.where(thrust < 0, limits[:, 0], limits[:, 1]))
