"""Figures 2 and 6 to 13 of the paper, from runs of its two examples."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.paper.thruster_response import MemorylessFit, ThrusterResponse
from undertow.report.figures import recorded, style
from undertow.report.figures.multiples import Block, small_multiples
from undertow.report.signal_names import axis_names, input_names

LOOKS = {"long": style.SOLID, "short": style.DASHED}
LAWS = style.Look("#555555", (0, (1, 1.2)), 1.2, 4)
LAWS_SECOND = style.Look("#555555", (0, (5, 1.2, 1, 1.2)), 1.0, 4)


Controllers = Mapping[str, xr.Dataset]  # rcafc, rafc or both


def thruster_laws(response: ThrusterResponse) -> Figure:
    """Thrust against current, thrust against voltage, and the error of each static model."""
    figure = style.blank(9.6, 3.5)
    periods = {"long": response.long, "short": response.short}
    names = {key: f"V = 10 sin {_times(period.frequency)}" for key, period in periods.items()}
    style.head(figure, "Fig. 2  Thruster of Table 3, one period in the steady state", {})
    against_current = style.place(figure, 0.62, 0.62, 2.75, 2.4)
    against_voltage = style.place(figure, 3.95, 0.62, 2.75, 2.4)
    errors = style.place(figure, 7.55, 0.62, 1.9, 2.4)
    linear, quadratic, current = response.laws
    for key, period in periods.items():
        _loop(against_current, period.current, period.thrust, names[key], LOOKS[key])
        _loop(against_voltage, period.voltage, period.thrust, names[key], LOOKS[key])
    thrust = np.array([response.long.thrust.min(), response.long.thrust.max()])
    _loop(against_current, current.coefficient * thrust, thrust, _fitted(current), LAWS)
    volts = np.sort(response.long.voltage)
    _loop(against_voltage, volts, linear.coefficient * volts, _fitted(linear), LAWS)
    _loop(against_voltage, volts, quadratic.coefficient * volts * np.abs(volts), _fitted(quadratic), LAWS_SECOND)
    style.label(against_current, "current I, A", "thrust T, N", "(a) T against I")
    style.label(against_voltage, "voltage V, V", "thrust T, N", "(b) T against V")
    for panel in (against_current, against_voltage):
        panel.legend(fontsize=style.TINY, frameon=False, loc="upper left", handlelength=3.2, borderaxespad=0.1)
    _errors(errors, response.laws)
    return figure


def _loop(panel: Axes, x: np.ndarray, y: np.ndarray, name: str, look: style.Look) -> None:
    panel.plot(x, y, **look._replace(width=look.width + 0.2).line, label=name)


def _errors(panel: Axes, laws: tuple[MemorylessFit, ...]) -> None:
    places = np.arange(len(laws))
    for key, shift, values in (
        ("long", -0.18, [law.error_long for law in laws]),
        ("short", 0.18, [law.error_short for law in laws]),
    ):
        hatch = "" if key == "long" else "////"
        bars = panel.barh(
            places + shift, values, 0.32, color=LOOKS[key].colour, hatch=hatch, edgecolor="white", linewidth=0, zorder=2
        )
        panel.bar_label(bars, fmt="%.0f %%", fontsize=style.TINY, padding=2)
    panel.set_yticks(places, [_typeset(law.text) for law in laws])
    panel.invert_yaxis()
    panel.set_xlim(0, 1.3 * max(max(law.error_long, law.error_short) for law in laws))
    style.label(panel, "rms error, % of rms", "", "(c) Error of each model")


def _times(frequency: float) -> str:
    return "t" if frequency == 1 else f"{frequency:g}t"


def _typeset(law: str) -> str:
    return "$" + law.replace("|V|", r"\,|V|") + "$"


def _fitted(law: MemorylessFit) -> str:
    symbol = law.text.split(" = ")[1].split()[0]
    return f"{_typeset(law.text)}, ${symbol}$ = {law.coefficient:.3g} {style.power(law.unit)}"


def robust_term(title: str, runs: Controllers) -> Figure:
    """Fig. 8."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    curves = [recorded.curve(run, name, "robust_term", look) for run, name, look in looks]
    end = float(first["time"].values[-1])
    return small_multiples(
        title,
        axis_names(first),
        [
            Block(curves, recorded.per_axis(first, "$u_r$", "/s^2"), height=1.05, titled=True),
            Block(curves, recorded.per_axis(first, "$u_r$", "/s^2"), height=1.05, window=(end / 2, end)),
        ],
    )


def effort(title: str, runs: Controllers) -> Figure:
    """Figs. 9 and 13."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    curves = [recorded.curve(run, name, "input", look) for run, name, look in looks]
    start, end = recorded.settled(first), float(first["time"].values[-1])
    labels = recorded.per_input(first, "voltage")
    return small_multiples(
        title,
        input_names(first),
        [
            Block(curves, labels, height=0.95, window=(0.0, start), titled=True),
            Block(curves, labels, height=0.95, width=2.1, window=(start, end)),
        ],
        columns=2,
        beside=True,
    )


STATE, MODEL = style.SOLID, style.DASHED._replace(width=1.3, order=4)
APART = style.Look("#555555", "-", 0.9, 3)


def identification(title: str, run: xr.Dataset) -> Figure:
    """Fig. 11."""
    state = recorded.curve(run, "state $x$", "position", STATE)
    model = recorded.curve(run, r"series-parallel state $\hat{x}$", "predicted_position", MODEL)
    model_error = recorded.difference(run, r"$\hat{x} - x$", "predicted_position", "position", APART)
    model_error = model_error._replace(values=1000 * model_error.values)
    thousandths = [text.replace(", ", ", m") for text in recorded.per_axis(run, r"$\hat{x} - x$")]
    return small_multiples(
        title,
        axis_names(run),
        [
            Block([state, model], recorded.places(run), height=1.1, titled=True),
            Block([model_error], thousandths, height=0.9),
        ],
    )


def uncertainty(title: str, runs: Controllers) -> Figure:
    """Figs. 7 and 12."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    true = recorded.curve(first, "true $d$", "uncertainty", style.TRUTH)
    estimates = [recorded.curve(run, name, "estimate", look) for run, name, look in looks]
    errors = [recorded.difference(run, name, "estimate", "uncertainty", look) for run, name, look in looks]
    start = recorded.settled(first)
    rate = "/s^2"
    return small_multiples(
        title,
        axis_names(first),
        [
            Block(
                [true, *estimates],
                recorded.per_axis(first, r"$d$, $\hat{d}$", rate),
                height=1.35,
                limits_from=start,
                titled=True,
            ),
            Block(errors, recorded.per_axis(first, r"$\hat{d} - d$", rate), height=0.85, limits_from=start),
        ],
    )


def tracking(title: str, runs: Controllers) -> Figure:
    """Figs. 6 and 10."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    desired = recorded.curve(first, "desired $x_d$", "reference", style.TRUTH)
    actual = [recorded.curve(run, name, "position", look) for run, name, look in looks]
    errors = [recorded.magnitude(recorded.curve(run, name, "error", look)) for run, name, look in looks]
    return small_multiples(
        title,
        axis_names(first),
        [
            Block([desired, *actual], recorded.places(first), height=1.1, titled=True),
            Block(errors, recorded.per_axis(first, "|error|"), height=1.0, scale="log"),
        ],
    )


def paper_figures(
    example1: Mapping[str, xr.Dataset], example2: Mapping[str, xr.Dataset], response: ThrusterResponse
) -> dict[str, Figure]:
    """The paper's figures by name: fig02, fig06, ..., fig13.

    Args:
        example1: runs of Example 1 by controller, `rcafc` and `rafc`.
        example2: runs of Example 2; as in the paper, only `rcafc` is plotted.
        response: the response of the thruster to a slow and a fast voltage.
    """
    of_controllers = {key: example1[key] for key in ("rcafc", "rafc")}
    alone = {"rcafc": example2["rcafc"]}
    return {
        "fig02": thruster_laws(response),
        "fig06": tracking("Fig. 6  Example 1: tracking", of_controllers),
        "fig07": uncertainty("Fig. 7  Example 1: lumped uncertainty and its estimates", of_controllers),
        "fig08": robust_term("Fig. 8  Example 1: robust term", of_controllers),
        "fig09": effort("Fig. 9  Example 1: control voltages", of_controllers),
        "fig10": tracking("Fig. 10  Example 2: tracking", alone),
        "fig11": identification("Fig. 11  Example 2: state and series-parallel state", alone["rcafc"]),
        "fig12": uncertainty("Fig. 12  Example 2: lumped uncertainty and its estimate", alone),
        "fig13": effort("Fig. 13  Example 2: control voltages", alone),
    }
