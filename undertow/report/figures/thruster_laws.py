"""Fig. 2: response of the motor to a slow and a fast voltage, compared with the static models."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from undertow.report.figures import style
from undertow.reproduction.thruster_response import Law, ThrusterResponse

LOOKS = {"long": style.SOLID, "short": style.DASHED}
LAWS = style.Look("#555555", (0, (1, 1.2)), 1.2, 4)
LAWS_SECOND = style.Look("#555555", (0, (5, 1.2, 1, 1.2)), 1.0, 4)


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
    panel.plot(
        x, y, color=look.colour, linestyle=look.dashes, linewidth=look.width + 0.2, zorder=look.order, label=name
    )


def _errors(panel: Axes, laws: tuple[Law, ...]) -> None:
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


def _fitted(law: Law) -> str:
    symbol = law.text.split(" = ")[1].split()[0]
    return f"{_typeset(law.text)}, ${symbol}$ = {law.coefficient:.3g} {style.power(law.unit)}"
