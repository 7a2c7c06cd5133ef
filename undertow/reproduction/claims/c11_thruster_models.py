"""C11: the static thruster models hold for long-period inputs only (Fig. 2)."""

from undertow.reproduction.claims.finding import Finding, Runs
from undertow.reproduction.horizons import Long, name_of
from undertow.reproduction.thruster_response import thruster_response

CLAIM = "T = c_0 V, T = c_V V|V| and I = c_I T hold only for long-period inputs."

# A model with a smaller error than this share of the signal counts as valid.
_VALID = 10.0  # %


def scenarios(quick: bool) -> dict:
    """None: Fig. 2 drives the motor alone, and the fidelity comparison shows the effect on the loop."""
    return {}


def judge(runs: Runs, long: Long) -> Finding:
    """Error of each model, fitted to V = 10 sin t, at V = 10 sin t and V = 10 sin 10t."""
    laws = thruster_response().laws
    numbers = {law.text: {"long": law.error_long, "short": law.error_short} for law in laws}
    text = "rms error in % of the signal at V = 10 sin t and 10 sin 10t: "
    text += "; ".join(f"{law.text} {law.error_long:.0f} and {law.error_short:.0f}" for law in laws)
    ends = {
        level: long[name_of(level, "rcafc")]
        for level in ("static", "shaft", "electromechanical")
        if name_of(level, "rcafc") in long
    }
    text += (
        ". The same difference acts in the loop of RCAFC at Table 1, U2 at 1 kHz: "
        + ", ".join(
            f"{level} lasts {run.ended:g} s" if run.lasted else f"{level} ends at {run.ended:.1f} s"
            for level, run in ends.items()
        )
        + "."
    )
    valid = [law.text for law in laws if law.error_long < _VALID]
    fails_short = all(law.error_short > _VALID for law in laws)
    if len(valid) == len(laws) and fails_short:
        verdict = "holds"
    elif fails_short and valid:
        verdict = f"holds if only {' and '.join(valid)} is meant: the others are wrong at long periods too"
    else:
        verdict = "fails"
    return Finding(verdict, text, "electromechanical_rcafc", "the motor alone, 8 periods; the loop as stated", numbers)
