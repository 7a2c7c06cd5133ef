"""Where the paper's idea wins, and where a plain linear observer is as good: one sentence per function."""

from undertow.reproduction.robust_variant.lookup import Numbers


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
    motor, sea = n.fidelity("electromechanical", "robust"), n.fidelity("sea", "robust")
    if not (motor["steady"] and sea["steady"]):
        return ""
    return (
        "One design for any plant of the form (17). Without a gain being given, the sound version tracks to "
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
    one, five = (n.median("A2", f"{count} sets", "estimation_rms") for count in (1, 5))
    return f"Fuzzy sets. A single one, an integrator, has {one / five:.3f} times the error of five (A2; see C5)."


def _input(n: Numbers) -> str:
    own, matched = (n.median("A1", name, "estimation_rms") for name in ("error", "state, matched"))
    return f"Fuzzy input. The state does {matched / own:.3f} times as badly at the same gamma |xi|^2 (A1; see C5)."


def _robust_term(n: Numbers) -> str:
    own, instead = n.median("A4", "with"), n.median("A4", "PD instead")
    return f"The robust term. A PD of the same slope has {instead / own:.3f} times the error (A4)."


def _tuned(n: Numbers) -> str:
    fuzzy, plain, rafc = (n.median("A6", f"{name}, tuned") for name in ("RCAFC", "linear observer", "RAFC"))
    return (
        f"Tuning. With the same budget, told on other seeds: RCAFC {fuzzy:.2g}, linear observer {plain:.2g}, "
        f"RAFC {rafc:.2g} m (A6)."
    )


def _limited(n: Numbers) -> str:
    fuzzy, plain = (n.median("A6", f"{name}, limited") for name in ("RCAFC", "linear observer"))
    told = "The linear observer, fed with the applied input too, is as safe"
    return f"Limits. {told}: {plain:.3g} m, RCAFC {fuzzy:.3g} m (A6)."


WINS = (_windup, _loss, _wrong_model, _one_design)
SAME = (_linear, _robust, _sets, _input, _robust_term, _tuned, _limited)
