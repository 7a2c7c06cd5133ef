"""Effect of a motor on the law of Table 1: a map over first-order lag, inductance of the winding, and horizon."""

from typing import Any

from undertow.analysis.motor_loop import lag_matrix, motor_matrix, stable_gains
from undertow.paper.horizons import Long, described, duration, sampled
from undertow.paper.running import BatchedRun
from undertow.paper.setup import law_of, motor_of, same_loop_gain, scenario

_THRUST_PER_VOLT = 17.107  # N/V, alpha of Eq. (15)
_LAGS = (0.001, 0.005, 0.01, 0.02, 0.05, 0.1, 0.15, 0.3)  # s
_WINDINGS = (0.0005, 0.001, 0.0015, 0.002, 0.003, 0.005, 0.007, 0.01)  # H; Table 3 has the last
_QUICK = {"lag": (0.01, 0.05, 0.15), "winding": (0.001, 0.002, 0.01)}

# Fuzzy sets -> options of the law, both with the same gamma |xi|^2.
_LAWS: dict[str, tuple[str, dict[str, Any]]] = {
    "five": ("five sets", {}),
    "one": ("one rule", same_loop_gain("error", 1)),
}

# One rule has no weights that can drift: it is stationary after a second, and a short run is enough.
_SHORT = 200.0  # s

# Propeller speed at which the loop is linearised, rad/s: 15 N of thrust.
_SPEED = 20.0
_LARGEST = 6000.0  # c, 1/s


def scenarios(quick: bool) -> dict[str, dict[str, Any]]:
    """Every run of the map, by name."""
    return {_name(*point): _scenario(*point, quick) for point in _points(quick)}


def table(long: Long, quick: bool) -> list[dict[str, Any]]:
    """One row per run, with the gains c of section 3.8 between which the loop is stable in theory."""
    rows = []
    for kind, value, law in _points(quick):
        name = _name(kind, value, law)
        facts = {"kind": kind, "value": value, "law": law, "words": _LAWS[law][0]}
        rows.append(described(name, facts, long[name]) | {"damping": damping(kind, value, long)})
    return rows


def windings(long: Long) -> dict[float, BatchedRun]:
    """Available runs of the law of Table 1 with five sets, by inductance of the winding, H."""
    named = {value: _name("winding", value, "five") for value in _WINDINGS}
    return {value: long[name] for value, name in named.items() if name in long}


def damping(kind: str, value: float, long: Long) -> tuple[float, float] | None:
    """Smallest and largest gain c, 1/s, of those up to 6,000 with which the linearised loop of five sets is stable."""
    run = long[_name(kind, value, "five")]
    law = law_of(run)
    if kind == "lag":
        return stable_gains(lambda gain: lag_matrix(law, value, drifted=gain), _LARGEST)
    return stable_gains(lambda gain: motor_matrix(law, motor_of(run), _SPEED, drifted=gain), _LARGEST)


def lag_thruster(lag: float) -> dict[str, Any]:
    """A thruster whose thrust is alpha V with a first-order lag, s."""
    return {"kind": "first_order", "thrust_per_volt": _THRUST_PER_VOLT, "time_constant": lag}


def _points(quick: bool) -> list[tuple[str, float, str]]:
    """Kind, lag (s) or inductance (H), and law of every run; quick: fewer of them, and five sets only."""
    values, laws = (_QUICK, ("five",)) if quick else ({"lag": _LAGS, "winding": _WINDINGS}, tuple(_LAWS))
    return [(kind, value, law) for kind in values for value in values[kind] for law in laws]


def _name(kind: str, value: float, law: str) -> str:
    return f"map_{kind}_{1e3 * value:g}m{'s' if kind == 'lag' else 'H'}_{law}".replace(".", "p")


def _scenario(kind: str, value: float, law: str, quick: bool) -> dict[str, Any]:
    words, options = _LAWS[law]
    seconds = duration(quick) if law == "five" else min(duration(quick), _SHORT)
    dynamics = f"a lag of {1e3 * value:g} ms" if kind == "lag" else f"a winding of {1e3 * value:g} mH"
    data = scenario(
        f"Table 1 with {words} and {dynamics}, suite U2 for {seconds:g} s",
        fidelity="electromechanical",
        controller=options,
        disturbance={"kind": "u2"},
        loop=sampled(seconds, substeps=1 if kind == "lag" else 2),
    )
    data["plant"]["thruster"] = (
        lag_thruster(value) if kind == "lag" else data["plant"]["thruster"] | {"inductance": value}
    )
    return data
