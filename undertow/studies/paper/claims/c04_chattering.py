"""C4: RCAFC chatters less."""

from undertow.studies.paper.claims.finding import Finding, Runs, compared

CLAIM = "RCAFC reduces chattering considerably."


def scenarios(quick: bool) -> dict:
    """Nothing beyond C2."""
    return {}


def judge(runs: Runs) -> Finding:
    """Total variation of the voltages; suite U1 itself accounts for most of it."""
    return compared(runs, "input_variation", "total variation of the voltages", "V/s")
