"""The claims on the estimate and the robust term, for RCAFC and RAFC; also under limits and noise."""

from typing import Any

from undertow.paper.claims.finding import EQUAL_GAIN, ClaimVerdict, Runs, at_table_1, claim, steady
from undertow.paper.horizons import BOUND, Long, sampled
from undertow.paper.running import BatchedRun
from undertow.paper.setup import RAFC, RCAFC, equal_gain, scenario

LIMITS = (150.0, 100.0, 60.0)  # V
NOISE = 0.01  # m/s, rad/s

# Name -> words, gamma_eps, gains.
_LAWS: dict[str, tuple[str, float, dict[str, Any]]] = {
    "rcafc": ("RCAFC", RCAFC, {}),
    "rafc": ("RAFC with gamma raised", RAFC, equal_gain()),
    "rafc_bounded": ("RAFC with gamma raised and weights within 20", RAFC, equal_gain() | {"weights_bound": BOUND}),
}


def _conditions(quick: bool) -> dict[str, dict[str, Any]]:
    """Example 1 at 1 kHz with limited voltages, and with noise of 1 cm/s on the velocities."""
    by_name = {}
    load = {"kind": "u2"}  # U1 for 20 s, as in the long runs, so that they share a program
    for law, (words, composite, gains) in _LAWS.items():
        common = {
            "composite": composite,
            "controller": {"weights_bound": float("inf")} | gains,
            "loop": sampled(20.0),
            "disturbance": load,
        }
        for volts in LIMITS:
            limited_scenario = scenario(f"{words}, voltages limited to {volts:g} V", **common)
            limited_scenario["plant"]["thruster"]["supply"] = volts
            by_name[_limited(law, volts)] = limited_scenario
        noise = {"kind": "white_noise", "velocity": NOISE}
        by_name[_noisy(law)] = scenario(f"{words}, 1 cm/s of velocity noise", navigation=noise, **common)
    return by_name


def sentences(long: Long, metric: str, unit: str) -> tuple[str, dict[str, Any]]:
    """The metric under limits and under noise, in words and as numbers (None: ended early)."""
    limited = {law: [_steady(long[_limited(law, volts)], metric) for volts in LIMITS] for law in _LAWS}
    tracking = {law: [_shown(long[_limited(law, volts)]) for volts in LIMITS] for law in _LAWS}
    noisy = {law: _steady(long[_noisy(law)], metric) for law in _LAWS}
    volts = ", ".join(f"{limit:g}" for limit in LIMITS)
    text = (
        f"This is so with unlimited voltages and exact velocities. With limits of {volts} V (1 kHz) "
        f"the tracking error of RCAFC is {_listed(tracking['rcafc'])} m and rad, that of RAFC with gamma raised "
        f"{_listed(tracking['rafc'])}, because "
        f"its weights wind up (with weights within {BOUND:g}: {_listed(tracking['rafc_bounded'])}). With 1 cm/s of "
        f"velocity noise: RCAFC {noisy['rcafc']:.3g} {unit}, RAFC with gamma raised {noisy['rafc']:.3g}."
    )
    return text, {"limits": list(LIMITS), "limited": limited, "noisy": noisy}


def lost_by_limits(long: Long) -> bool:
    """Whether RAFC with gamma raised is worse than RCAFC at every limit."""
    worse = lambda volts: (
        (_steady(long[_limited("rafc", volts)], "tracking_rms") or float("inf"))
        > 10 * (_steady(long[_limited("rcafc", volts)], "tracking_rms") or float("inf"))
    )
    return all(map(worse, LIMITS))


def worse_by_noise(long: Long, metric: str) -> bool:
    """Whether the metric of RAFC with gamma raised is larger than that of RCAFC under noise."""
    return (_steady(long[_noisy("rafc")], metric) or float("inf")) > (_steady(long[_noisy("rcafc")], metric) or 0.0)


def _limited(law: str, volts: float) -> str:
    return f"c02_{law}_{volts:g}V"


def _noisy(law: str) -> str:
    return f"c02_{law}_noise"


def _steady(run: BatchedRun, metric: str) -> float | None:
    metrics = run.windows[0]
    return None if metrics is None else metrics[metric]


def _shown(run: BatchedRun) -> str:
    error = _steady(run, "tracking_rms")
    return f"none (it ends after {run.ended:.1f} s)" if error is None else f"{error:.2g}"


def _listed(words: list[str]) -> str:
    return f"{', '.join(words[:-1])} and {words[-1]}"


def _estimation_scenarios(quick: bool) -> dict:
    """RAFC at equal loop gain."""
    words = "RAFC with gamma raised to the loop gain of RCAFC"
    return {EQUAL_GAIN: scenario(words, composite=RAFC, controller=equal_gain())}


@claim(
    "C2",
    "RCAFC estimates the lumped uncertainty better than RAFC.",
    scenarios=_estimation_scenarios,
    batched=_conditions,
)
def estimation(runs: Runs, long: Long) -> ClaimVerdict:
    """At the paper's gains, at equal tuning effort, and at that under limits and noise."""
    return compared(runs, long, "estimation_rms", "rms estimation error", "m/s^2")


def compared(runs: Runs, long: Long, metric: str, what: str, unit: str) -> ClaimVerdict:
    """Verdict on `RCAFC has a smaller <metric> than RAFC`."""
    text, numbers = at_table_1(runs, metric, what, unit)
    rcafc, rafc, fair = numbers.values()
    rafc_error, rcafc_error = (steady(runs[name])["tracking_rms"] for name in (EQUAL_GAIN, "ideal_rcafc"))
    text += f" Its tracking error is {100 * (1 - rafc_error / rcafc_error):.1f} % smaller than that of RCAFC."
    more, more_numbers = sentences(long, metric, unit)
    numbers = numbers | more_numbers
    text = f"{text} {more}"
    simulated = "level ideal, U1, 20 s"
    if rcafc >= rafc:
        return ClaimVerdict("fails", text, "ideal_rcafc", simulated, numbers)
    if rcafc < fair:
        return ClaimVerdict("holds", text, "ideal_rcafc", simulated, numbers)
    conditions = []
    if lost_by_limits(long):
        conditions.append(f"voltages are limited to {max(LIMITS):g} V or less while the weights are unlimited")
    if worse_by_noise(long, metric):
        conditions.append("velocities are noisy (1 cm/s)")
    else_where = (
        f"; at equal loop gain only where {' or '.join(conditions)}" if conditions else "; not at equal loop gain"
    )
    return ClaimVerdict(f"holds if both use the gamma of Table 1{else_where}", text, EQUAL_GAIN, simulated, numbers)


@claim("C3", "RCAFC needs a smaller robust control signal than RAFC.")
def robust_term(runs: Runs, long: Long) -> ClaimVerdict:
    """As C2, since for small signals u_r is the filtered estimation error."""
    return compared(runs, long, "robust_rms", "rms robust term", "m/s^2")
