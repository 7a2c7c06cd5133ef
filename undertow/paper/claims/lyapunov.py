"""The claims of the proof: the Lyapunov function never increases, and P solves its equation."""

import numpy as np

from undertow.analysis.certificate.function import of_set_point, share_increasing
from undertow.paper.claims.finding import ClaimVerdict, Runs, claim
from undertow.paper.horizons import Long
from undertow.paper.setup import GOAL, SIX_AXES, law_of, scenario

_SIMULATED = "constant d on six axes without a motor; level ideal, U1; 20 s"

_CONSTANT = [5.0, -3.0, 2.0, 1.0, -1.0, 0.5]  # m/s^2, rad/s^2


def _lyapunov_function_decreases_scenarios(quick: bool) -> dict:
    """A constant d, to which the proof applies exactly."""
    return {
        "c12_constant": scenario(
            "RCAFC under constant uncertainty: the Lyapunov function never increases",
            disturbance={"kind": "sinusoid", "amplitude": 0.0, "frequency": [1.0] * 6, "offset": _CONSTANT},
            **(SIX_AXES | {"reference": {"kind": "setpoint", "position": GOAL}}),  # pyright: ignore[reportArgumentType] - options in one mapping
        )
    }


@claim("C12", "V_dot <= 0 along every solution (Eqs. (46)-(58)).", scenarios=_lyapunov_function_decreases_scenarios)
def lyapunov_function_decreases(runs: Runs, long: Long) -> ClaimVerdict:
    """Share of 10 ms steps at which V_f grows: constant d with theta* = d, and suite U1 with the minimax theta*."""
    law = law_of(runs["ideal_rcafc"])
    run_by_load = {"constant": runs["c12_constant"], "u1": runs["ideal_rcafc"]}
    steps = {name: share_increasing(of_set_point(law, run.dataset)) for name, run in run_by_load.items()}
    text = (
        f"Constant d: V_f grows at {100 * steps['constant']:.2g} % of the 10 ms steps. Suite U1, with the best "
        f"constant theta*: at {100 * steps['u1']:.0f} %. The bound needs omega_bar > |omega|, half the "
        "range of d, which Table 1 (0.1) does not give."
    )
    if steps["constant"] > 0:
        return ClaimVerdict("fails", text, "c12_constant", _SIMULATED, steps)
    if steps["u1"] > 0:
        return ClaimVerdict("holds if d is constant", text, "ideal_rcafc", _SIMULATED, steps)
    return ClaimVerdict("holds", text, "ideal_rcafc", _SIMULATED, steps)


@claim("C13", "A positive definite P solves Eq. (21) for the gains of Table 1.")
def lyapunov_equation(runs: Runs, long: Long) -> ClaimVerdict:
    """Residual of Eq. (21) and eigenvalues of P."""
    law = law_of(runs["ideal_rcafc"])
    p, (k1, k2), q = np.asarray(law.lyapunov()), np.asarray(law.feedback), np.asarray(law.weight)
    a = np.array([[0.0, 1.0], [-k1, -k2]])
    residual = float(np.abs(a.T @ p + p @ a + q).max())
    smallest = float(np.linalg.eigvalsh(p).min())
    text = f"P = {p.tolist()}, smallest eigenvalue {smallest:.3f}, residual {residual:.1g}."
    is_solution = residual <= 1e-12 * np.abs(q).max() and smallest > 0
    verdict = "holds" if is_solution else "fails"
    numbers = {"residual": residual, "smallest": smallest}
    return ClaimVerdict(verdict, text, "ideal_rcafc", "algebra, nothing is simulated", numbers)
