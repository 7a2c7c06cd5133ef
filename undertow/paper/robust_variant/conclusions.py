"""Conclusions from the numbers: advantages of the paper's law, equivalence of a linear observer, and limits."""

from collections.abc import Sequence
from typing import Any

from undertow.paper.ablations.verdicts import ABLATIONS
from undertow.paper.robust_variant import fidelity

Rows = Sequence[dict[str, Any]]

_RECOVERED = 0.01  # m, rad


class NotRun(Exception):
    """A quick reproduction has omitted it."""


class Numbers:
    """Medians of the ablations, and rows of the fidelity comparison; a missing one is a KeyError."""

    def __init__(self, compared: Rows, ablations: Rows):
        not_run = {(run.place, run.law): None for run in fidelity.runs(False)}
        self._compared = not_run | {(row["place"], row["law"]): row for row in compared}
        self._ablations = {ablation.id: None for ablation in ABLATIONS} | {
            row["id"]: {variant["name"]: variant for variant in row["variants"]} for row in ablations
        }

    def median(self, ablation: str, variant: str, metric: str = "tracking_rms") -> float:
        """Median of a metric over the seeds."""
        return self._variant(ablation, variant)["metrics"][metric]["median"]

    def failures(self, ablation: str, variant: str) -> tuple[int, int]:
        """Number of runs that ended early, and of all runs."""
        row = self._variant(ablation, variant)
        return row["failures"], row["seeds"]

    def fidelity(self, case: str, law: str) -> dict[str, Any]:
        """A row of the fidelity comparison."""
        return _there(self._compared[case, law])

    def _variant(self, ablation: str, variant: str) -> dict[str, Any]:
        return _there(self._ablations[ablation])[variant]


def conclusions(compared: Rows, ablations: Rows) -> dict[str, list[str]]:
    """Lists of sentences; one whose numbers were not computed, or contradict it, is omitted.

    Raises:
        KeyError: a sentence uses an ablation, a variant or a row that does not exist.
    """
    numbers = Numbers(compared, ablations)
    texts = {kind: [_text_of(sentence, numbers) for sentence in sentences] for kind, sentences in _KINDS.items()}
    return {kind: list(filter(None, of_kind)) for kind, of_kind in texts.items()}


def _text_of(sentence, numbers: Numbers) -> str:
    try:
        return sentence(numbers)
    except NotRun:
        return ""


def _there(value: Any) -> Any:
    if value is None:
        raise NotRun
    return value


def _windup(n: Numbers) -> str:
    rcafc, fed = n.median("A10", "RCAFC, 1.5 m/s^2"), n.median("A10", "RCAFC, command fed, 1.5 m/s^2")
    rafc = n.median("A10", "RAFC, 1.5 m/s^2")
    if not rcafc < 0.01 * min(fed, rafc):
        return ""
    return (
        f"The applied input in the identification model. After a step of 2 m with |u| <= 1.5 m/s^2 the error of RCAFC "
        f"is {rcafc:.2g} m; with its own command in the model it is {fed:.3g} m, that of RAFC {rafc:.3g} m (A10)."
    )


def _loss(n: Numbers) -> str:
    none, one_off = (n.median("A13", f"Table 1, {what}") for what in ("none", "one off"))
    failed, seeds = n.failures("A13", "Table 1, one off")
    if failed or not one_off < 0.01:
        return ""
    return (
        f"Undetected loss of thrust. With one of ODIN's eight thrusters off, a random one for each of "
        f"{seeds} seeds, no run ends early; the error grows from {none:.2g} to {one_off:.2g} (A13; thrusters without "
        "lag)."
    )


def _wrong_model(n: Numbers) -> str:
    exact, weak = n.median("A12", "Table 1, exact"), n.median("A12", "Table 1, thrust x 0.4")
    return f"A wrong model. Thrusters with 0.4 of their nominal thrust raise the error {weak / exact:.2g} times (A12)."


def _one_design(n: Numbers) -> str:
    motor, sea = n.fidelity("electromechanical", "robust"), n.fidelity("sea", "robust")
    if not (motor["steady"] and sea["steady"]):
        return ""
    return (
        "One design for any plant of the form (17). Without a given gain, preset `robust` tracks to "
        f"{motor['steady']['tracking_rms']:.2g} on ODIN with the full motor model at 1 kHz (20 s) and to "
        f"{sea['steady']['tracking_rms']:.2g} on BlueROV2 Heavy at sea at 100 Hz (120 s); for other plants see C14."
    )


def _linear(n: Numbers) -> str:
    fuzzy = n.median("A3", "RCAFC")
    plain = n.median("A3", "linear observer") / fuzzy
    return f"Accuracy. A linear observer of the same bandwidth has {plain:.3f} times the error of RCAFC (A3)."


def _robust(n: Numbers) -> str:
    robust = n.median("A3", "robust")
    kinds = (", 1 set", "'s linear observer", "'s INDI")
    one_set, plain, indi = (n.median("A3", f"robust{kind}") / robust for kind in kinds)
    return (
        "Preset `robust` is neither fuzzy nor composite by default: no tracking error in the adaptation, no robust "
        "term, sets so wide that the basis is nearly constant. Relative to its tracking error that of one set is "
        f"{one_set:.4f}, of a linear observer of the same poles {plain:.4f}, of INDI {indi:.4f} (A3; axes without lag)."
    )


def _sets(n: Numbers) -> str:
    one_set, five = (n.median("A2", name, "estimation_rms") for name in ("1 set", "5 sets"))
    return f"Fuzzy sets. A single one, an integrator, has {one_set / five:.3f} times the error of five (A2, C5)."


def _input(n: Numbers) -> str:
    error_input, matched = (n.median("A1", name, "estimation_rms") for name in ("error", "state, matched"))
    return f"Fuzzy input. The state has {matched / error_input:.3f} times the error at the same gamma |xi|^2 (A1, C5)."


def _robust_term(n: Numbers) -> str:
    with_term, with_pd = n.median("A4", "with, exact"), n.median("A4", "PD instead, exact")
    return f"The robust term. A PD of the same slope has {with_pd / with_term:.3f} times the error (A4)."


def _tuned(n: Numbers) -> str:
    fuzzy, plain, rafc = (n.median("A6", f"{name}, tuned") for name in ("RCAFC", "linear observer", "RAFC"))
    return (
        f"Tuning. With the same budget, evaluated on other seeds: RCAFC {fuzzy:.2g}, linear observer {plain:.2g}, "
        f"RAFC {rafc:.2g} m (A6)."
    )


def _limited(n: Numbers) -> str:
    fuzzy, plain = (n.median("A6", f"{name}, limited") for name in ("RCAFC", "linear observer"))
    safe = "The linear observer, with the applied input too, is as robust"
    return f"Limits. {safe}: {plain:.3g} m, RCAFC {fuzzy:.3g} m (A6)."


def _motor(n: Numbers) -> str:
    paper, robust = n.fidelity("electromechanical", "rcafc"), n.fidelity("electromechanical", "robust")
    if paper["status"] == "completed":
        return ""
    error = robust["steady"]["tracking_rms"]
    return (
        f"A motor. With all of Eqs. (8) to (11) Table 1 ends after {paper['diverged_at']:.2g} s; preset `robust`, "
        f"which models the motor, tracks to {error:.2g} without propeller speeds (20 s; 2,000 s: see the long runs)."
    )


def _supply(n: Numbers) -> str:
    paper, robust = (n.fidelity("24V_03", law)["steady"] for law in ("rcafc", "robust"))
    return (
        f"A limited supply. At 24 V and U1 x 0.3 Table 1 is saturated {100 * paper['saturated_fraction']:.0f} % of the "
        f"time with an error of {paper['tracking_rms']:.2g}; `robust` {100 * robust['saturated_fraction']:.0f} % and "
        f"{robust['tracking_rms']:.2g}."
    )


def _noise(n: Numbers) -> str:
    paper, slow = (n.median("A9", f"{law}, 1 mm/s", "input_rms") / 1e-3 for law in ("Table 1", "robust 10 rad/s"))
    return (
        f"Noise. Table 1 amplifies velocity noise in the input by {paper:.0f} 1/s, an observer of 10 rad/s by "
        f"{slow:.1f} 1/s (A9)."
    )


def _drift(n: Numbers) -> str:
    lost, seeds = n.failures("A18", "nothing")
    projected, weight = n.median("A18", "projection 6"), n.median("A18", "one set", "weights_peak")
    return (
        f"Drift. With sets spaced 0.1 and 1 cm/s of noise {lost} of {seeds} runs end within 20 s; projected weights "
        f"keep {projected:.2g} m, and a single set, the linear observer, does not drift (|theta| {weight:.2g}; A18)."
    )


def _delay(n: Numbers) -> str:
    lost, seeds = n.failures("A8", "Table 1, 6 ms")
    slow = n.median("A8", "robust 20 rad/s, 15 ms")
    return (
        f"Delay. With a delay of 6 ms {lost} of {seeds} runs of Table 1 end early; an observer of 20 rad/s tolerates "
        f"15 ms with an error of {slow:.2g} m (A8)."
    )


def _frequency(n: Numbers) -> str:
    low, high = (n.median("A7", f"RCAFC, {rate} rad/s", "share") for rate in (10, 150))
    return f"High frequency. Error of the estimate: {100 * low:.2g} % of d at 10 rad/s, {100 * high:.0f} % at 150 (A7)."


def _at_sea(n: Numbers) -> str:
    paper, hand, robust = (n.fidelity("sea", law) for law in ("table1", "hand_tuned", "robust"))
    if paper["status"] == "completed":
        return ""
    return (
        f"At sea. On BlueROV2 Heavy Table 1 ends after {paper['diverged_at']:.2g} s. The paper's law tuned by hand "
        f"holds {hand['steady']['tracking_rms']:.3g}; `robust`, not tuned, {robust['steady']['tracking_rms']:.3g}."
    )


def _navigation(n: Numbers) -> str:
    pid, robust = (n.fidelity("station", law) for law in ("pid", "robust"))
    exact = [n.fidelity("station_known", law) for law in ("pid", "robust")]
    if not all(row["steady"] for row in (pid, robust, *exact)):
        return ""
    without, ours = (row["position_rms"] for row in exact)
    centimetres = lambda metres: f"{100 * metres:.2g} cm"
    return (
        f"Limits of navigation. Station keeping in waves with position fixes of 5 cm, the error of navigation is "
        f"{centimetres(robust['navigation_rms'])}: a tuned PID holds {centimetres(pid['position_rms'])}, `robust` "
        f"{centimetres(robust['position_rms'])}. Here better fixes help, not a better law; where position and velocity "
        f"are exact, they hold {centimetres(without)} and {centimetres(ours)}."
    )


def _recovery(n: Numbers) -> str:
    paper, robust = n.fidelity("overload", "rcafc"), n.fidelity("overload", "robust")
    if not (robust["steady"] and paper["steady"]):
        return ""
    late_error = robust["steady"]["tracking_rms"]
    how = "back at" if late_error < _RECOVERED else "not back yet, but at"
    return (
        f"An overload of 1.5 s. Beyond the authority of its motors at 24 V, the error of `robust` is up to "
        f"{robust['largest_after']:.2g} m or rad, after 7.5 s {how} {late_error:.2g}; that of Table 1 is up to "
        f"{paper['largest_after']:.2g}, then {paper['steady']['tracking_rms']:.2g}."
    )


def _beyond(n: Numbers) -> str:
    paper, robust = (n.fidelity("24V", law)["steady"]["tracking_rms"] for law in ("rcafc", "robust"))
    return (
        f"A load beyond the actuators. U1 at full size exceeds the thrust at 24 V: the error of Table 1 is "
        f"{paper:.2g} m and rad, that of `robust` {robust:.2g}; no law can hold it."
    )


def _slow_rate(n: Numbers) -> str:
    paper, robust = (n.median("A8", f"{law}, 100 Hz") for law in ("Table 1", "robust"))
    if not robust > paper:
        return ""
    return (
        f"Slow sampling of axes without a motor. At 100 Hz with exact velocities, Table 1 tracks to {paper:.2g} m for "
        f"the 10 s of A8, on drifting weights; `robust` keeps margins against 20 ms of unknown delay, and tracks to "
        f"{robust:.2g} m."
    )


def _noisy_motor(n: Numbers) -> str:
    robust, searched = (n.median("A20", law, "input_variation") for law in ("robust", "robust, searched"))
    if not robust > 2 * searched:
        return ""
    return (
        f"Unmodelled noise. With 2 mm/s of velocity noise the voltage of `robust` varies by {robust:.2g} V/s; with a "
        f"bandwidth and an actuator rate found by search by {searched:.2g} V/s (A20)."
    )


_KINDS = {
    "wins": (_windup, _loss, _wrong_model, _one_design),
    "same": (_linear, _robust, _sets, _input, _robust_term, _tuned, _limited),
    "loses": (_motor, _supply, _noise, _drift, _delay, _frequency),
    "neither": (_at_sea, _navigation, _recovery, _beyond, _slow_rate, _noisy_motor),
}
