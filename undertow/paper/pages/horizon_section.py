"""Long runs of the paper's controllers behind several motor models: a part of the section on fidelity levels."""

from collections.abc import Mapping, Sequence
from typing import Any

from undertow.paper.all_outputs import unit_of
from undertow.report.formats import CRITERION, number, outcome, prose, round_time, unit
from undertow.report.page import Html, join, table, tag

CAPTIONS = {
    "horizons": prose(
        "The upper panels show the largest weight against time; a cross marks a run that ended early. Thin grey lines "
        "are the same controllers with weights bounded by 20. The lower panel shows the time of divergence of RCAFC on "
        "the full motor model for each composite gain: free weights (blue) drift until the loop diverges; with bounded "
        "weights (grey) it lasts."
    ),
    "lags": prose(
        "The upper panels show thrust that follows the voltage with a first-order lag, the lower panels the motor of "
        "Table 3 with other inductances. Five sets tolerate every lag from 1 to 300 ms, with chattering and growing "
        "weights. One rule at the same loop gain enters a limit cycle at once. A line stops where runs ended early."
    ),
    "drifting": prose(
        "One sinusoid acts per axis. Weights that differ between sets give $\\hat d = z - c \\varepsilon$, and $c$ "
        "grows with the square of the oscillation: $\\dot c = \\gamma \\gamma_\\varepsilon |\\xi'|^2 \\varepsilon^2$. "
        "It stops growing where the linearised loop with this $c$ is stable (dotted); the chattering decays, and the "
        "error is that of Example 1. With weights bounded by 20, $c$ cannot reach this value, and the limit cycle "
        "persists."
    ),
}


def horizon_section(results: Mapping[str, Any], figures: Mapping[str, Html]) -> list[Html]:
    """The long runs, the map of lags and the mechanism; empty if they were not run.

    Args:
        results: of results.json; `horizons`, `lags` and `drifting` are used.
        figures: figures by name.
    """
    content = []
    figure = lambda name: figures.get(name, Html(""))
    if results.get("horizons"):
        content += [*_horizons(results["horizons"]), figure("horizons"), _table(results["horizons"])]
    if results.get("lags"):
        content += [tag("h3", "Effect of a lag and of the winding inductance"), figure("lags")]
        content.append(_lags(results["lags"], results["horizons"]["windows"]))
    if results.get("drifting"):
        content += [tag("h3", "Mechanism: drifting weights add damping"), figure("drifting")]
    return content


def _horizons(results: Mapping[str, Any]) -> list[Html]:
    text = (
        f"The same fidelity levels for {results['duration']:.0f} s of suite U2, which repeats U1 every 20 s (U1 itself "
        "cannot be continued, because its chirp keeps rising), sampled at 1 kHz. Each controller runs with free "
        "weights and with weights bounded by 20 m/s^2 or rad/s^2. Metrics are computed over three windows, chattering "
        "from every sample."
    )
    colours = f"{CRITERION} The window is the last one that the run reached."
    return [tag("h3", f"Long runs: {results['duration']:.0f} s"), tag("p", prose(text)), tag("p", prose(colours))]


def _table(results: Mapping[str, Any]) -> Html:
    windows = results["windows"]
    rows = []
    last = None
    for row in results["rows"]:
        level = tag("b", row["level"]) if row["level"] != last else ""
        last = row["level"]
        name = join(prose(row["words"]), tag("div", tag("code", row["scenario"]), class_="small"))
        rows.append((level, name, _ended(row), *_by_window(row, windows)))
    return _wide(("level", "controller", f"status after {results['duration']:g} s"), windows, rows)


def _lags(rows: Sequence[Mapping[str, Any]], windows: Sequence[Sequence[float]]) -> Html:
    """One row per run of the map, with the prediction for drifted weights beside five sets."""
    table_rows = []
    for row in rows:
        size = f"{1e3 * row['value']:g}"
        dynamics = f"lag {size} ms" if row["kind"] == "lag" else f"winding {size} mH"
        between = row["damping"]
        theory = "" if row["law"] != "five" else "never" if between is None else _between(between)
        table_rows.append((prose(dynamics), row["words"], theory, _ended(row), *_by_window(row, windows)))
    return _wide(("behind", "controller", join("stable for c, ", unit("1/s")), "status"), windows, table_rows)


def _between(gains: Sequence[float]) -> str:
    low, high = gains
    return f"above {low:.0f}" if high >= 6000 else f"{low:.0f} to {high:.0f}"


def _ended(row: Mapping[str, Any]) -> Html:
    word = str(row["status"]).replace("_", " ")
    text = f"lasts {row['ended']:g} s" if row["lasted"] else f"{word} at {round_time(row['ended'])} s"
    return outcome(text, row["lasted"], row["within"])


def _by_window(row: Mapping[str, Any], windows: Sequence[Sequence[float]]) -> list[Html]:
    metrics = ("tracking_rms", "input_variation", "weights_peak")
    return [number(row[metric][i]) for metric in metrics for i in range(len(windows))]


def _wide(head: Sequence[str], windows: Sequence[Sequence[float]], rows: Sequence[Sequence[Any]]) -> Html:
    names = {"tracking rms": "tracking_rms", "variation": "input_variation", "largest weight": "weights_peak"}
    over = [tag("div", Html(f"{a:g} to {b:g}&nbsp;s"), class_="small") for a, b in windows]
    titles = [join(name, " ", unit(unit_of(metric)), when) for name, metric in names.items() for when in over]
    return table((*head, *titles), rows, numeric=range(len(head), len(head) + len(titles)), wide=True)
