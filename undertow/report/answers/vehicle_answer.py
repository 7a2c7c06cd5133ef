"""The answer of a vehicle by itself: whether its numbers are plausible, and how it behaves in the water."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from undertow.physics.plants.reachability import lost_directions
from undertow.physics.vehicles.facts import Facts
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity
from undertow.scenario.checks.finding import Finding

_NEUTRAL = 1e-3  # of the weight, below which buoyancy is the same
_TILT = 10.0  # degrees


def answer_of_vehicle(facts: Facts, findings: Sequence[Finding]) -> PlainAnswer:
    """The answer of a vehicle.

    Args:
        facts: its numbers.
        findings: of its check, errors first.
    """
    worst = tuple(f"{finding.sentence()}." for finding in findings[:1])
    lines = (*worst, *vehicle_lines(facts))
    if not findings:
        return PlainAnswer(True, "Its numbers are plausible.", lines)
    if findings[0].level == "error":
        return PlainAnswer(False, "Its numbers are not possible.", lines)
    return PlainAnswer(None, "Its numbers can be used, but not all of them are plausible.", lines)


def vehicle_lines(facts: Facts) -> Iterator[str]:
    """What the numbers of a vehicle mean: weight in water, stability, drag, and what its thrusters control."""
    yield _weight_in_water(facts)
    yield _righting(facts)
    drag = np.diag(facts.linear_damping) + np.diag(facts.quadratic_damping)
    surge, sway, heave = (quantity(float(force), "N") for force in drag[:3])
    yield f"Its drag at 1 m/s is {surge} forward, {sway} sideways and {heave} vertically."
    yield _thrusters(facts)


def _weight_in_water(facts: Facts) -> str:
    net = facts.buoyancy - facts.weight
    if abs(net) < _NEUTRAL * facts.weight:
        return f"Its mass is {facts.mass:.4g} kg, and it is neutral in water."
    motion, than = ("floats up", "lighter") if net > 0 else ("sinks", "heavier")
    difference = f"{quantity(abs(net), 'N')} ({quantity(abs(net) / facts.weight, '')})"
    at_rest = f"Without thrust it {motion}: it is {difference} {than} than the water it displaces."
    return f"Its mass is {facts.mass:.4g} kg. {at_rest}"


def _righting(facts: Facts) -> str:
    moment = float(facts.weight * facts.r_g[2] - facts.buoyancy * facts.r_b[2]) * math.sin(math.radians(_TILT))
    if moment <= 0:
        return "Nothing rights it in roll and pitch without thrust."
    return f"Tilted by {_TILT:g} degrees in roll or pitch, it is righted by {quantity(moment, 'N m')}."


def _thrusters(facts: Facts) -> str:
    count = len(facts.positions)
    controlled = 6 - len(lost_directions(facts.thruster_matrix))
    subject = "Its thruster controls" if count == 1 else f"Its {count} thrusters control"
    return f"{subject} {'all six' if controlled == 6 else f'{controlled} of the six'} degrees of freedom."
