"""C3: the robust term of RCAFC is smaller."""

from undertow.reproduction.claims.c02_estimation import compared
from undertow.reproduction.claims.finding import Finding, Runs
from undertow.reproduction.horizons import Long

CLAIM = "RCAFC needs a smaller robust control signal than RAFC."


def scenarios(quick: bool) -> dict:
    """No runs besides those of C2."""
    return {}


def judge(runs: Runs, long: Long) -> Finding:
    """As C2, since for small signals u_r is the filtered estimation error."""
    return compared(runs, long, "robust_rms", "rms robust term", "m/s^2")
