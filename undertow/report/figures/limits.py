"""Ranges of the y axes; values outside are noted above the panel."""

import re
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator

from undertow.core.number_text import plain
from undertow.report.figures import style

_LARGEST = 1e100
_SMALL, _LARGE = 1e-2, 1e5  # outside of these tick labels are long

# Powers of ten that have a prefix, and units that take one: the first of a product or quotient, if it is no power.
_PREFIXES = {-9: "n", -6: "\u00b5", -3: "m", 3: "k", 6: "M"}
_PREFIXABLE = re.compile(r"(m|rad|s|V|A|N|W|J)(?![\w^$])")

Named = Sequence[tuple[str, np.ndarray, np.ndarray]]  # name, time, values


def fit_linear(panel: Axes, series: Named, start: float, least: float = 0.0) -> None:
    """Fit to the values after `start`, s; earlier values outside the panel are noted above it.

    The axis spans at least `least`, so that what is of no account does not fill the panel.
    """
    late_values = _finite([values[time >= start] for _, time, values in series])
    if not late_values.size:
        return
    low, high = float(late_values.min()), float(late_values.max())
    margin = 0.08 * (high - low) or 0.08 * max(abs(high), 1e-12)
    margin = max(margin, (least - (high - low)) / 2)
    _fit(panel, series, start, low - margin, high + margin)


def fit_from_zero(panel: Axes, series: Named, start: float, least: float) -> None:
    """Fit sizes after `start`, s, from zero up to at least `least`; earlier ones outside are noted above the panel."""
    late_values = _finite([values[time >= start] for _, time, values in series])
    if late_values.size:
        _fit(panel, series, start, 0.0, max(1.08 * float(late_values.max()), least) or 1.0)


def _fit(panel: Axes, series: Named, start: float, low: float, high: float) -> None:
    panel.set_ylim(low, high)
    _shorten(panel)
    beyond = {}
    for name, _, values in series:
        outside = np.where(np.isfinite(values), np.maximum(values - high, low - values), -np.inf)
        if outside.size and outside.max() > 0:
            beyond[name] = plain(values[outside.argmax()])
    if beyond:
        peak_words = [f"{name} to {value}".lstrip() for name, value in beyond.items()]
        peaks = set(beyond.values())
        if len(beyond) == len(series) and len(peaks) == 1:  # all the same, in few words beside the name of the panel
            peak_words = [f"to {peaks.pop()}"]
        note = f"first {start:.2g} s: {', '.join(peak_words)}"
        style.note(panel, note, (1, 1), (0, 2), color=style.INK, ha="right", va="bottom")


def _shorten(panel: Axes) -> None:
    """Powers of ten of tick labels that would reach into the label of the axis become part of its unit."""
    size = max(map(abs, panel.get_ylim()))
    if _SMALL <= size < _LARGE:
        return
    power = 3 * int(np.floor(np.log10(size) / 3))
    quantity, _, unit = panel.get_ylabel().rpartition(", ")
    prefixed = power in _PREFIXES and _PREFIXABLE.match(unit)
    panel.set_ylabel(f"{quantity}, {_PREFIXES[power]}{unit}" if prefixed else f"{quantity}, $10^{{{power}}}$ {unit}")
    panel.yaxis.set_major_formatter(lambda value, _: f"{value / 10.0**power:.4g}".replace("-", "\u2212"))


def fit_log(panel: Axes, series: Named, start: float = 0.0, least: float = 0.0) -> None:
    """Logarithmic scale; its bottom leaves out the dips at zero crossings."""
    del start, least
    sizes = _finite([values for _, _, values in series])
    sizes = sizes[sizes > 0]
    if sizes.size:  # nothing positive has no logarithm
        panel.set_yscale("log", nonpositive="mask")
        style.few_log_ticks(panel.yaxis)
        panel.set_ylim(float(np.quantile(sizes, 0.02)) / 2, 2 * float(sizes.max()))


def fit_symmetric(panel: Axes, series: Named, start: float = 0.0, least: float = 0.0) -> None:
    """Linear about zero, logarithmic outside, for runs that diverged."""
    del start, least
    early_peak = max(early_size(time, values) for _, time, values in series)
    panel.set_yscale("symlog", linthresh=10.0 ** np.ceil(np.log10(max(early_peak, 1e-12))))
    sizes = np.abs(_finite([values for _, _, values in series]))
    if sizes.size and sizes.max() > 0:
        top = 10.0 ** np.floor(np.log10(sizes.max()))
        panel.yaxis.set_major_locator(FixedLocator([-top, 0.0, top]))


def early_size(time: np.ndarray, values: np.ndarray) -> float:
    """Median size in the first third of a record, before a run failed."""
    sizes = np.abs(_finite([values[time <= time[0] + (time[-1] - time[0]) / 3].ravel()])) if len(time) else np.zeros(0)
    return float(np.median(sizes)) if sizes.size else 0.0


def _finite(parts: Sequence[np.ndarray]) -> np.ndarray:
    values = np.concatenate(parts) if parts else np.zeros(0)
    return values[drawable(values)]


def drawable(values: np.ndarray) -> np.ndarray:
    """Which values an axis can have: finite ones, and not the last ones before an overflow."""
    return np.abs(values) < _LARGEST  # NaN is not
