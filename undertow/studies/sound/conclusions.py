"""Where the paper's idea wins, where a plain linear observer is as good, and where it loses: sentences with numbers."""

from collections.abc import Callable, Sequence
from typing import Any

Rows = Sequence[dict[str, Any]]

WINS, SAME, LOSES = "wins", "same", "loses"

_RECOVERED = 0.01  # m, rad


def conclusions(ladder: Rows, ablations: Rows) -> dict[str, list[str]]:
    """Three lists of sentences; one whose numbers were not computed, or say otherwise, is left out."""
    found = {WINS: [], SAME: [], LOSES: []}
    numbers = Numbers(ladder, ablations)
    for kind, sentence in _SENTENCES:
        try:
            said = sentence(numbers)
        except KeyError:  # not among what was run
            continue
        if said:
            found[kind].append(said)
    return found


class Numbers:
    """Medians of the ablations, and rows of the ladder."""

    def __init__(self, ladder: Rows, ablations: Rows):
        self._ladder = {(row["place"], row["law"]): row for row in ladder}
        self._variants = {(one["id"], each["name"]): each for one in ablations for each in one["variants"]}

    def median(self, ablation: str, variant: str, metric: str = "tracking_rms") -> float:
        """Over the seeds."""
        return self._variants[ablation, variant]["metrics"][metric]["median"]

    def failures(self, ablation: str, variant: str) -> tuple[int, int]:
        """Runs that ended early, and runs."""
        one = self._variants[ablation, variant]
        return one["failures"], one["seeds"]

    def rung(self, place: str, law: str) -> dict[str, Any]:
        """A row of the ladder."""
        return self._ladder[place, law]


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
        f"Loss of thrust that nobody is told of. With one of ODIN's eight thrusters off, drawn anew for each of "
        f"{seeds} seeds, no run ends early; the error grows from {none:.2g} to {one:.2g} (A13; thrusters without lag)."
    )


def _wrong_model(n: Numbers) -> str:
    exact, weak = n.median("A12", "Table 1, exact"), n.median("A12", "Table 1, thrust x 0.4")
    return f"A wrong model. Thrusters that give 0.4 of what is believed raise the error {weak / exact:.2g} times (A12)."


def _one_design(n: Numbers) -> str:
    motor, sea = n.rung("electromechanical", "robust"), n.rung("sea", "robust")
    if not (motor["steady"] and sea["steady"]):
        return ""
    return (
        "One design for any plant of the form (17). Without a gain being given, the sound version tracks to "
        f"{motor['steady']['tracking_rms']:.2g} on ODIN with the whole motor at 1 kHz and to "
        f"{sea['steady']['tracking_rms']:.2g} on BlueROV2 Heavy at sea at 100 Hz; for other plants see C14."
    )


def _linear(n: Numbers) -> str:
    fuzzy = n.median("A3", "RCAFC")
    plain = n.median("A3", "linear observer") / fuzzy
    return f"Accuracy. A textbook linear observer of the same bandwidth has {plain:.3f} times the error of RCAFC (A3)."


def _sets(n: Numbers) -> str:
    one, five = (n.median("A2", f"{count} sets", "estimation_rms") for count in (1, 5))
    return f"Fuzzy sets. A single one, which is an integrator, has {one / five:.3f} times the error of five (A2)."


def _input(n: Numbers) -> str:
    own, matched = (n.median("A1", name, "estimation_rms") for name in ("error", "state, matched"))
    return f"Fuzzy input. The state does {matched / own:.3f} times as badly at the same gamma |xi|^2 (A1)."


def _robust_term(n: Numbers) -> str:
    own, instead = n.median("A4", "with"), n.median("A4", "PD instead")
    return f"The robust term. A PD of the same slope has {instead / own:.3f} times the error (A4)."


def _tuned(n: Numbers) -> str:
    fuzzy, plain, rafc = (n.median("A6", f"{name}, tuned") for name in ("RCAFC", "linear observer", "RAFC"))
    return (
        f"Each tuned with the same budget, told on other seeds: RCAFC {fuzzy:.2g}, linear observer {plain:.2g}, "
        f"RAFC {rafc:.2g} m (A6)."
    )


def _limited(n: Numbers) -> str:
    fuzzy, plain = (n.median("A6", f"{name}, limited") for name in ("RCAFC", "linear observer"))
    told = "The linear observer, fed with the applied input too, is as safe"
    return f"Limits. {told}: {plain:.3g} m, RCAFC {fuzzy:.3g} m (A6)."


def _motor(n: Numbers) -> str:
    paper, sound = n.rung("electromechanical", "rcafc"), n.rung("electromechanical", "robust")
    if paper["status"] == "ok":
        return ""
    kept = sound["steady"]["tracking_rms"]
    return (
        f"A motor. With all of Eqs. (8) to (11) Table 1 ends after {paper['diverged_at']:.2g} s; preset `robust`, "
        f"which knows the motor, tracks to {kept:.2g} without propeller speeds."
    )


def _supply(n: Numbers) -> str:
    paper, sound = (n.rung("24V_03", law)["steady"] for law in ("rcafc", "robust"))
    return (
        f"A supply. At 24 V and U1 x 0.3 Table 1 is at its limit {100 * paper['saturated_fraction']:.0f} % of the time "
        f"and {paper['tracking_rms']:.2g} off; `robust` {100 * sound['saturated_fraction']:.0f} % and "
        f"{sound['tracking_rms']:.2g}."
    )


def _noise(n: Numbers) -> str:
    paper, slow = (n.median("A9", f"{law}, 1 mm/s", "voltage_rms") / 1e-3 for law in ("Table 1", "robust 10 rad/s"))
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
    low, high = (n.median("A7", f"{rate} rad/s", "share") for rate in (10, 150))
    return f"High frequency. The estimate misses {100 * low:.2g} % of d at 10 rad/s and {100 * high:.0f} % at 150 (A7)."


def _beyond(n: Numbers) -> str:
    paper, sound = (n.rung("24V", law)["steady"]["tracking_rms"] for law in ("rcafc", "robust"))
    return (
        f"What nobody can do. U1 at full size asks for more than 24 V gives: Table 1 is {paper:.2g} off, `robust` "
        f"{sound:.2g}; no law holds it."
    )


def _recovery(n: Numbers) -> str:
    paper, sound = n.rung("overload", "rcafc"), n.rung("overload", "robust")
    if not (sound["steady"] and paper["steady"]):
        return ""
    after = sound["steady"]["tracking_rms"]
    how = "back to" if after < _RECOVERED else "not back yet, but at"
    return (
        f"Too much for 1.5 s. Pushed beyond its motors at 24 V, `robust` is up to {sound['largest_after']:.2g} off, "
        f"and after 7.5 s {how} {after:.2g}; Table 1 up to {paper['largest_after']:.2g}, then "
        f"{paper['steady']['tracking_rms']:.2g}."
    )


def _at_sea(n: Numbers) -> str:
    paper, hand, sound = (n.rung("sea", law) for law in ("table1", "hand_tuned", "robust"))
    if paper["status"] == "ok":
        return ""
    return (
        f"At sea. On BlueROV2 Heavy Table 1 ends after {paper['diverged_at']:.2g} s. The paper's law tuned by hand "
        f"holds {hand['steady']['tracking_rms']:.3g}; `robust`, not tuned, "
        f"{sound['steady']['tracking_rms']:.3g}."
    )


_SENTENCES: tuple[tuple[str, Callable[[Numbers], str]], ...] = (
    (WINS, _windup),
    (WINS, _loss),
    (WINS, _wrong_model),
    (WINS, _one_design),
    (SAME, _linear),
    (SAME, _sets),
    (SAME, _input),
    (SAME, _robust_term),
    (SAME, _tuned),
    (SAME, _limited),
    (LOSES, _motor),
    (LOSES, _supply),
    (LOSES, _noise),
    (LOSES, _drift),
    (LOSES, _delay),
    (LOSES, _frequency),
    (LOSES, _at_sea),
    (LOSES, _recovery),
    (LOSES, _beyond),
)
