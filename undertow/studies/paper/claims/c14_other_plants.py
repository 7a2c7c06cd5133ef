"""C14: the method works for other plants."""

from undertow.studies.paper.claims.finding import Finding, Runs

CLAIM = "The method works for other systems x_ddot = f + G u + d (pendulum, magnetic levitation)."


def scenarios(quick: bool) -> dict:
    """None yet."""
    return {}


def judge(runs: Runs) -> Finding:
    """Open until the companion plants exist."""
    return Finding("open", "The inverted pendulum and the magnetic levitation are not in this version.", None)
