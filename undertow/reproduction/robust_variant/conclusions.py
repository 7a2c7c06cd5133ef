"""What the numbers say: where the paper's idea wins, where a linear observer is as good, where either law loses."""

from collections.abc import Sequence
from typing import Any

from undertow.reproduction.ablations.verdicts import ABLATIONS
from undertow.reproduction.robust_variant import fidelity

Rows = Sequence[dict[str, Any]]

_RECOVERED = 0.01  # m, rad


class NotRun(Exception):
    """A quick look has left it out."""


class Numbers:
    """Medians of the ablations, and rows of the fidelity comparison; asking for what does not exist is a KeyError."""

    def __init__(self, compared: Rows, ablations: Rows):
        everything = {(place, law): None for place, one in fidelity.places(False).items() for law in one.runs}
        self._compared = everything | {(row["place"], row["law"]): row for row in compared}
        self._ablations = {one.id: None for one in ABLATIONS} | {
            one["id"]: {each["name"]: each for each in one["variants"]} for one in ablations
        }

    def median(self, ablation: str, variant: str, metric: str = "tracking_rms") -> float:
        """Over the seeds."""
        return self._variant(ablation, variant)["metrics"][metric]["median"]

    def failures(self, ablation: str, variant: str) -> tuple[int, int]:
        """Runs that ended early, and runs."""
        one = self._variant(ablation, variant)
        return one["failures"], one["seeds"]

    def fidelity(self, place: str, law: str) -> dict[str, Any]:
        """A row of the fidelity comparison."""
        return _there(self._compared[place, law])

    def _variant(self, ablation: str, variant: str) -> dict[str, Any]:
        return _there(self._ablations[ablation])[variant]


def conclusions(compared: Rows, ablations: Rows) -> dict[str, list[str]]:
    """Lists of sentences; one whose numbers were not computed, or say otherwise, is left out.

    Raises:
        KeyError: a sentence asks for an ablation, a variant or a row that does not exist.
    """
    numbers = Numbers(compared, ablations)
    return {kind: [said for one in sentences if (said := _said(one, numbers))] for kind, sentences in _KINDS.items()}


def _said(sentence, numbers: Numbers) -> str:
    try:
        return sentence(numbers)
    except NotRun:
        return ""


def _there(found: Any) -> Any:
    if found is None:
        raise NotRun
    return found


def _windup(n: Numbers) -> str:
    own, deaf = n.median("A10", "RCAFC, 1.5 m/s^2"), n.median("A10", "RCAFC, command fed, 1.5 m/s^2")
    without = n.median("A10", "RAFC, 1.5 m/s^2")
    if not own < 0.01 * min(deaf, without):
        return ""
    return (
        f"Feeding the identification model with the applied input. After a step of 2 m with |u| <= 1.5 m/s^2 RCAFC is "
        f"back to {own:.2g} m; fed with its own command it is {deaf:.3g} m off, and RAFC {without:.3g} m (A10)."
    )


def _loss(n: Numbers) -> str:
    none, one = (n.median("A13", f"Table 1, {what}") for what in ("none", "one off"))
    failed, seeds = n.failures("A13", "Table 1, one off")
    if failed or not one < 0.01:
        return ""
    return (
        f"Undetected loss of thrust. With one of ODIN's eight thrusters off, drawn anew for each of "
        f"{seeds} seeds, no run ends early; the error grows from {none:.2g} to {one:.2g} (A13; thrusters without lag)."
    )


def _wrong_model(n: Numbers) -> str:
    exact, weak = n.median("A12", "Table 1, exact"), n.median("A12", "Table 1, thrust x 0.4")
    return f"A wrong model. Thrusters that give 0.4 of what is believed raise the error {weak / exact:.2g} times (A12)."


def _one_design(n: Numbers) -> str:
    motor, sea = n.fidelity("electromechanical", "robust"), n.fidelity("sea", "robust")
    if not (motor["steady"] and sea["steady"]):
        return ""
    return (
        "One design for any plant of the form (17). Without a gain being given, preset `robust` tracks to "
        f"{motor['steady']['tracking_rms']:.2g} on ODIN with the whole motor at 1 kHz (20 s) and to "
        f"{sea['steady']['tracking_rms']:.2g} on BlueROV2 Heavy at sea at 100 Hz (120 s); for other plants see C14."
    )


def _linear(n: Numbers) -> str:
    fuzzy = n.median("A3", "RCAFC")
    plain = n.median("A3", "linear observer") / fuzzy
    return f"Accuracy. A linear observer of the same bandwidth has {plain:.3f} times the error of RCAFC (A3)."


def _robust(n: Numbers) -> str:
    own = n.median("A3", "robust")
    one, plain, indi = (n.median("A3", f"robust{kind}") / own for kind in (", 1 set", "'s linear observer", "'s INDI"))
    return (
        "Preset `robust` is neither fuzzy nor composite as delivered: no tracking error in the adaptation, no robust "
        "term, sets so wide that the basis hardly moves. Over its tracking error that of one set is "
        f"{one:.4f}, of a linear observer of the same poles {plain:.4f}, of INDI {indi:.4f} (A3; axes without lag)."
    )


def _sets(n: Numbers) -> str:
    one, five = (n.median("A2", name, "estimation_rms") for name in ("1 set", "5 sets"))
    return f"Fuzzy sets. A single one, an integrator, has {one / five:.3f} times the error of five (A2; see C5)."


def _input(n: Numbers) -> str:
    own, matched = (n.median("A1", name, "estimation_rms") for name in ("error", "state, matched"))
    return f"Fuzzy input. The state does {matched / own:.3f} times as badly at the same gamma |xi|^2 (A1; see C5)."


def _robust_term(n: Numbers) -> str:
    own, instead = n.median("A4", "with, exact"), n.median("A4", "PD instead, exact")
    return f"The robust term. A PD of the same slope has {instead / own:.3f} times the error (A4)."


def _tuned(n: Numbers) -> str:
    fuzzy, plain, rafc = (n.median("A6", f"{name}, tuned") for name in ("RCAFC", "linear observer", "RAFC"))
    return (
        f"Tuning. With the same budget, evaluated on other seeds: RCAFC {fuzzy:.2g}, linear observer {plain:.2g}, "
        f"RAFC {rafc:.2g} m (A6)."
    )


def _limited(n: Numbers) -> str:
    fuzzy, plain = (n.median("A6", f"{name}, limited") for name in ("RCAFC", "linear observer"))
    safe = "The linear observer, fed with the applied input too, is as safe"
    return f"Limits. {safe}: {plain:.3g} m, RCAFC {fuzzy:.3g} m (A6)."


def _motor(n: Numbers) -> str:
    paper, robust = n.fidelity("electromechanical", "rcafc"), n.fidelity("electromechanical", "robust")
    if paper["status"] == "completed":
        return ""
    kept = robust["steady"]["tracking_rms"]
    return (
        f"A motor. With all of Eqs. (8) to (11) Table 1 ends after {paper['diverged_at']:.2g} s; preset `robust`, "
        f"which knows the motor, tracks to {kept:.2g} without propeller speeds (20 s; 2,000 s: see the long runs)."
    )


def _supply(n: Numbers) -> str:
    paper, robust = (n.fidelity("24V_03", law)["steady"] for law in ("rcafc", "robust"))
    return (
        f"A supply. At 24 V and U1 x 0.3 Table 1 is at its limit {100 * paper['saturated_fraction']:.0f} % of the time "
        f"and {paper['tracking_rms']:.2g} off; `robust` {100 * robust['saturated_fraction']:.0f} % and "
        f"{robust['tracking_rms']:.2g}."
    )


def _noise(n: Numbers) -> str:
    paper, slow = (n.median("A9", f"{law}, 1 mm/s", "input_rms") / 1e-3 for law in ("Table 1", "robust 10 rad/s"))
    return (
        f"Noise. Table 1 passes velocity noise into the input times {paper:.0f} 1/s, an observer of 10 rad/s times "
        f"{slow:.1f} (A9)."
    )


def _drift(n: Numbers) -> str:
    lost, seeds = n.failures("A18", "nothing")
    kept, weight = n.median("A18", "projection 6"), n.median("A18", "one set", "weights_peak")
    return (
        f"Drift. With sets spaced 0.1 and 1 cm/s of noise {lost} of {seeds} runs end within 20 s; projected weights "
        f"keep {kept:.2g} m, and a single set, the linear observer, has no drift at all (|theta| {weight:.2g}; A18)."
    )


def _delay(n: Numbers) -> str:
    lost, seeds = n.failures("A8", "Table 1, 6 ms")
    slow = n.median("A8", "robust 20 rad/s, 15 ms")
    return (
        f"Delay. Measurements 6 ms late end {lost} of {seeds} runs of Table 1; an observer of 20 rad/s bears 15 ms, "
        f"for an error of {slow:.2g} m (A8)."
    )


def _frequency(n: Numbers) -> str:
    low, high = (n.median("A7", f"RCAFC, {rate} rad/s", "share") for rate in (10, 150))
    return f"High frequency. The estimate misses {100 * low:.2g} % of d at 10 rad/s and {100 * high:.0f} % at 150 (A7)."


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
    known = [n.fidelity("station_known", law) for law in ("pid", "robust")]
    if not all(row["steady"] for row in (pid, robust, *known)):
        return ""
    without, ours = (row["position_rms"] for row in known)
    centimetres = lambda metres: f"{100 * metres:.2g} cm"
    return (
        f"Beyond its navigation. Keeping station in waves with position fixes of 5 cm, navigation itself is off by "
        f"{centimetres(robust['navigation_rms'])}: a tuned PID holds {centimetres(pid['position_rms'])}, `robust` "
        f"{centimetres(robust['position_rms'])}. Better fixes help here, not a better law; where position and velocity "
        f"are known, they hold {centimetres(without)} and {centimetres(ours)}."
    )


def _recovery(n: Numbers) -> str:
    paper, robust = n.fidelity("overload", "rcafc"), n.fidelity("overload", "robust")
    if not (robust["steady"] and paper["steady"]):
        return ""
    after = robust["steady"]["tracking_rms"]
    how = "back to" if after < _RECOVERED else "not back yet, but at"
    return (
        f"Too much for 1.5 s. Pushed beyond its motors at 24 V, `robust` is up to {robust['largest_after']:.2g} off, "
        f"and after 7.5 s {how} {after:.2g}; Table 1 up to {paper['largest_after']:.2g}, then "
        f"{paper['steady']['tracking_rms']:.2g}."
    )


def _beyond(n: Numbers) -> str:
    paper, robust = (n.fidelity("24V", law)["steady"]["tracking_rms"] for law in ("rcafc", "robust"))
    return (
        f"What nobody can do. U1 at full size asks for more than 24 V gives: Table 1 is {paper:.2g} off, `robust` "
        f"{robust:.2g}; no law holds it."
    )


def _slow_rate(n: Numbers) -> str:
    paper, robust = (n.median("A8", f"{law}, 100 Hz") for law in ("Table 1", "robust"))
    if not robust > paper:
        return ""
    return (
        f"Slow sampling of plain axes. At 100 Hz, velocities exact and no motor, Table 1 tracks to {paper:.2g} m for "
        f"the 10 s of A8, on drifting weights; `robust` keeps room for three sampling times of delay, and tracks to "
        f"{robust:.2g} m."
    )


def _noisy_motor(n: Numbers) -> str:
    own, searched = (n.median("A20", law, "input_variation") for law in ("robust", "robust, searched"))
    if not own > 2 * searched:
        return ""
    return (
        f"Unmodelled noise. With 2 mm/s of velocity noise `robust` moves the voltage by {own:.2g} V/s; with a "
        f"bandwidth and an actuator rate found by search by {searched:.2g} V/s (A20)."
    )


_KINDS = {
    "wins": (_windup, _loss, _wrong_model, _one_design),
    "same": (_linear, _robust, _sets, _input, _robust_term, _tuned, _limited),
    "loses": (_motor, _supply, _noise, _drift, _delay, _frequency),
    "neither": (_at_sea, _navigation, _recovery, _beyond, _slow_rate, _noisy_motor),
}
