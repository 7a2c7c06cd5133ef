"""Warnings about the vehicle of a scenario that can be run."""

from undertow.checks.vehicle_lint import Facts, facts_of, lint
from undertow.scenario.build import Built
from undertow.scenario.vehicle_data import parse
from undertow.vehicles.vehicle import Vehicle


def vehicle_facts(built: Built) -> Facts | None:
    """Facts of the vehicle of a scenario; None where its plant is not a vehicle."""
    vehicle = getattr(built.closed_loop.plant, "vehicle", None)
    if not isinstance(vehicle, Vehicle):
        return None
    description = built.resolved["plant"].get("vehicle", {})
    return parse(description["contents"]).facts() if "contents" in description else facts_of(vehicle)


def vehicle_warnings(built: Built) -> tuple[str, ...]:
    """A sentence for each impossible property, and for a weight that is not that of the mass.

    The latter results from changing the mass only, in a scenario or from trial to trial.
    """
    facts = vehicle_facts(built)
    findings = () if facts is None else lint(facts)
    shown = [finding for finding in findings if finding.level == "error" or finding.rule == "gravity"]
    if _mass_alone(built):
        stays = "With `mass` alone changed, weight and buoyancy stay: give `weight` and `buoyancy`, too"
        shown = [finding._replace(hint=stays) if finding.rule == "gravity" else finding for finding in shown]
    return tuple(f"{finding.says}. {finding.hint}".rstrip(". ") for finding in shown)


def _mass_alone(built: Built) -> bool:
    description = built.resolved["plant"].get("vehicle", {})
    return "mass" in description and "weight" not in description
