"""C1: tracking converges to a small neighbourhood of zero."""

from undertow.core.status import Status
from undertow.studies.paper.claims.finding import Finding, Runs, steady

CLAIM = "The tracking error converges to a small neighbourhood of zero."


def scenarios(quick: bool) -> dict:
    """Nothing beyond the ladder."""
    return {}


def judge(runs: Runs) -> Finding:
    """On every rung of the ladder."""
    largest = {rung: steady(runs[f"{rung}_rcafc"])["tracking_max"] for rung in ("ideal", "static")}
    full = runs["electromechanical_rcafc"]
    numbers = {f"tracking_max_{rung}": value for rung, value in largest.items()}
    text = (
        f"RCAFC at Table 1: largest error from 10 s on is {largest['ideal']:.2g} m or rad where thrust follows voltage "
        f"at once, {largest['static']:.2g} with the motor in its steady state; "
    )
    if full.status is Status.OK:
        text += f"{steady(full)['tracking_max']:.2g} with the whole motor."
        return Finding("holds", text, "ideal_rcafc", numbers)
    text += f"with the whole motor of Table 3 the loop is unstable and ends at {float(full.outcome.ended):.2f} s."
    numbers["ended_electromechanical"] = float(full.outcome.ended)
    return Finding("holds if the motor has no dynamics", text, "electromechanical_rcafc", numbers)
