"""C12: the Lyapunov function never increases."""

from undertow.analysis.certificate import lyapunov_function, minimax_weight, share_increasing
from undertow.reproduction.claims.finding import Finding, Runs
from undertow.reproduction.horizons import Long
from undertow.reproduction.setup import GOAL, SIX_AXES, law_of, scenario

CLAIM = "V_dot <= 0 along every solution (Eqs. (46)-(58))."

_SIMULATED = "constant d on six axes without a motor; level ideal, U1; 20 s"

_CONSTANT = [5.0, -3.0, 2.0, 1.0, -1.0, 0.5]  # m/s^2, rad/s^2


def scenarios(quick: bool) -> dict:
    """A constant d, to which the proof applies exactly."""
    return {
        "c12_constant": scenario(
            "RCAFC under constant uncertainty: the Lyapunov function never increases",
            disturbance={"kind": "sinusoid", "amplitude": 0.0, "frequency": [1.0] * 6, "offset": _CONSTANT},
            **(SIX_AXES | {"reference": {"kind": "setpoint", "position": GOAL}}),  # pyright: ignore[reportArgumentType] - options in one mapping
        )
    }


def judge(runs: Runs, long: Long) -> Finding:
    """Share of 10 ms steps at which V_f grows: constant d with theta* = d, and suite U1 with the minimax theta*."""
    constant, varying = runs["c12_constant"], runs["ideal_rcafc"]
    law = law_of(varying)
    steps = {
        "constant": share_increasing(lyapunov_function(law, constant.dataset, minimax_weight(constant.dataset))),
        "u1": share_increasing(lyapunov_function(law, varying.dataset, minimax_weight(varying.dataset))),
    }
    text = (
        f"Constant d: V_f grows at {100 * steps['constant']:.2g} % of the 10 ms steps. Suite U1, with the best "
        f"constant theta*: at {100 * steps['u1']:.0f} %. The bound needs omega_bar > |omega|, half the "
        "range of d, which Table 1 (0.1) does not give."
    )
    if steps["constant"] > 0:
        return Finding("fails", text, "c12_constant", _SIMULATED, steps)
    if steps["u1"] > 0:
        return Finding("holds if d is constant", text, "ideal_rcafc", _SIMULATED, steps)
    return Finding("holds", text, "ideal_rcafc", _SIMULATED, steps)
