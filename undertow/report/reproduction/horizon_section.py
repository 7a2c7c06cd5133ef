"""For how long the paper's laws last, behind which motor, and why: parts of the section on fidelities of the report."""

from collections.abc import Mapping, Sequence
from typing import Any

from undertow.report.formats import number, prose, round_time
from undertow.report.page import Html, join, table, tag

FIGURES = ("horizons", "lags", "drifting")

CAPTIONS = {
    "horizons": (
        "Above, the largest weight against time; a cross marks a run that ended early. Thin grey lines are the same "
        "laws with their weights projected into a box of 20. Below, how long RCAFC lasts on the whole motor for each "
        "composite gain: weights that are free (blue) drift until the loop is lost; bounded ones (grey) last."
    ),
    "lags": (
        "Above, thrust follows the voltage with a first-order lag; below, the motor of Table 3 with another "
        "inductance. Five sets bear every lag that was tried, 1 to 300 ms, at the price of chattering and "
        "growing weights; one rule at the "
        "same loop gain stays, at once, in a limit cycle. Where a line stops, runs had ended."
    ),
    "drifting": (
        "With one sinusoid per axis. Weights that differ from set to set make d_hat = z \u2212 c \u03b5, and c grows "
        "with the square of the oscillation: \u010b = \u03b3 \u03b3_\u03b5 |\u03be'|\u00b2 \u03b5\u00b2. It stops "
        "growing where the linearised loop with that c is stable (dotted): the chattering dies, the error is that of "
        "Example 1. In a box of 20 c cannot get there, and the limit cycle stays."
    ),
}


def horizon_section(results: Mapping[str, Any], drawn: Mapping[str, Html]) -> list[Html]:
    """The long runs, the map of lags and the mechanism; nothing if they were not run.

    Args:
        results: of results.json; `horizons`, `lags` and `drifting` are used.
        drawn: figures by name.
    """
    content = []
    if results.get("horizons"):
        content += [*_horizons(results["horizons"]), *_figure(drawn, "horizons"), _table(results["horizons"])]
    if results.get("lags"):
        content += [tag("h3", "What a lag does, and what a winding"), *_figure(drawn, "lags")]
        content.append(_lags(results["lags"], results["horizons"]["windows"]))
    if results.get("drifting"):
        content += [tag("h3", "Why a lag is borne: weights that drift are damping"), *_figure(drawn, "drifting")]
    return content


def _horizons(found: Mapping[str, Any]) -> list[Html]:
    told = (
        f"The same levels for {found['duration']:,.0f} s of suite U2, which is U1 again every 20 s (U1 itself must "
        "not be run on: its chirp sweeps up for ever), sampled at 1 kHz. Each law runs as it is and with its weights "
        "projected into a box of 20 m/s^2, rad/s^2. Metrics are taken over three windows, chattering from every sample."
    )
    return [tag("h3", f"For how long: {found['duration']:,.0f} s"), tag("p", prose(told))]


def _table(found: Mapping[str, Any]) -> Html:
    windows = found["windows"]
    rows, last = [], None
    for row in found["rows"]:
        level = tag("b", row["level"]) if row["level"] != last else ""
        last = row["level"]
        name = join(prose(row["words"]), tag("div", tag("code", row["scenario"]), class_="small"))
        rows.append((level, name, _ended(row), *_by_window(row, windows)))
    return _wide(("level", "law", f"of {found['duration']:g} s"), windows, rows)


def _lags(rows: Sequence[Mapping[str, Any]], windows: Sequence[Sequence[float]]) -> Html:
    """One row per run of the map; what theory says of drifted weights stands beside five sets."""
    shown = []
    for row in rows:
        unit = "ms" if row["kind"] == "lag" else "mH"
        behind = f"{'lag' if row['kind'] == 'lag' else 'winding'} {1e3 * row['value']:g} {unit}"
        between = row["damping"]
        theory = "" if row["law"] != "five" else "never" if between is None else _between(between)
        shown.append((behind, row["words"], theory, _ended(row), *_by_window(row, windows)))
    return _wide(("behind", "law", "stable for c, 1/s", "how it ended"), windows, shown)


def _between(gains: Sequence[float]) -> str:
    low, high = gains
    return f"from {low:.0f} on" if high >= 6000 else f"{low:.0f} to {high:.0f}"


def _ended(row: Mapping[str, Any]) -> Html:
    word = str(row["status"]).replace("_", " ")
    said = f"lasts {row['ended']:g} s" if row["lasted"] else f"{word} at {round_time(row['ended'])} s"
    return tag("span", said, class_=f"chip {'holds' if row['lasted'] else 'fails'}")


def _by_window(row: Mapping[str, Any], windows: Sequence[Sequence[float]]) -> list[Html]:
    metrics = ("tracking_rms", "input_variation", "weights_peak")
    return [number(row[metric][i]) for metric in metrics for i in range(len(windows))]


def _wide(head: Sequence[str], windows: Sequence[Sequence[float]], rows: Sequence[Sequence[Any]]) -> Html:
    names = ("tracking rms", "variation, V/s", "largest weight")
    titles = [join(name, tag("div", f"{a:g} to {b:g} s", class_="small")) for name in names for a, b in windows]
    return table((*head, *titles), rows, numeric=range(len(head), len(head) + len(titles)), wide=True)


def _figure(drawn: Mapping[str, Html], name: str) -> list[Html]:
    return [drawn[name]] if name in drawn else []
