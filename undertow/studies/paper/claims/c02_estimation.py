"""C2: RCAFC estimates d better than RAFC."""

from undertow.studies.paper.claims.finding import EQUAL_GAIN, Finding, Runs, compared, equal_gain_scenario

CLAIM = "RCAFC estimates the lumped uncertainty better than RAFC."


def scenarios(quick: bool) -> dict:
    """RAFC at equal loop gain."""
    return {EQUAL_GAIN: equal_gain_scenario()}


def judge(runs: Runs) -> Finding:
    """At the paper's gains and at equal tuning effort."""
    return compared(runs, "estimation_rms", "rms estimation error", "m/s^2")
