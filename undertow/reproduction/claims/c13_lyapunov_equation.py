"""C13: P solves the Lyapunov equation (21)."""

import numpy as np

from undertow.reproduction.claims.finding import Finding, Runs
from undertow.reproduction.horizons import Long
from undertow.reproduction.setup import law_of

CLAIM = "A positive definite P solves Eq. (21) for the gains of Table 1."


def scenarios(quick: bool) -> dict:
    """No runs besides Example 1."""
    return {}


def judge(runs: Runs, long: Long) -> Finding:
    """Residual of Eq. (21) and eigenvalues of P."""
    law = law_of(runs["ideal_rcafc"])
    p, (k1, k2), q = np.asarray(law.lyapunov()), np.asarray(law.feedback), np.asarray(law.weight)
    a = np.array([[0.0, 1.0], [-k1, -k2]])
    residual = float(np.abs(a.T @ p + p @ a + q).max())
    smallest = float(np.linalg.eigvalsh(p).min())
    text = f"P = {p.tolist()}, smallest eigenvalue {smallest:.3f}, residual {residual:.1g}."
    good = residual <= 1e-12 * np.abs(q).max() and smallest > 0
    verdict, numbers = "holds" if good else "fails", {"residual": residual, "smallest": smallest}
    return Finding(verdict, text, "ideal_rcafc", "algebra, nothing is simulated", numbers)
