"""C3: the robust term of RCAFC is smaller."""

from undertow.studies.paper.claims.finding import Finding, Runs, compared

CLAIM = "RCAFC needs a smaller robust control signal than RAFC."


def scenarios(quick: bool) -> dict:
    """Nothing beyond C2."""
    return {}


def judge(runs: Runs) -> Finding:
    """At the paper's gains and at equal tuning effort. In small signal u_r is the filtered estimation error."""
    return compared(runs, "robust_rms", "rms robust term", "m/s^2")
