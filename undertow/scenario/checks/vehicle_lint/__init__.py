"""Linter of vehicles: whether the parameters are possible and plausible. Each rule checks one property.

A linter checks numbers, not code. Of the defects found in published models it cannot find: wrong integration and time
steps (tests/loop/test_sampled_to_continuous.py: answers converge as the step is halved; tests/numerics/
test_integrators.py), wrong kinematics (tests/numerics/test_rotations.py, tests/physics/test_output_rates.py), Coriolis
terms missing or doing work (tests/physics/test_inertia_forces.py), forces that change when motion is reversed or
mirrored (tests/physics/test_mirror.py), creation of energy (tests/physics/test_energy_balance.py), state that
leaks between runs (tests/loop/test_sampled_to_continuous.py: run twice, same bits).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from undertow.core.contracts import AbstractPlant
from undertow.core.errors import Advice, advice, error_location
from undertow.physics.vehicles.facts import Facts as Facts
from undertow.physics.vehicles.facts import facts_of as facts_of
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.scenario.build import Built
from undertow.scenario.checks.finding import Finding
from undertow.scenario.checks.vehicle_lint import hydrodynamics, layout, mass, statics, transcription
from undertow.scenario.checks.vehicle_lint.layout import scaled
from undertow.scenario.vehicle_file import vehicle_location
from undertow.scenario.vehicle_schema import angles_of

_RULES = (*mass.RULES, *statics.RULES, *hydrodynamics.RULES, *layout.RULES, *layout.OF_DIRECTIONS, *transcription.RULES)


def lint(facts: Facts) -> tuple[Finding, ...]:
    """All errors and advice on a vehicle, errors first; without those that angles in radians or a wrong size cause."""
    consequences = set(layout.OF_DIRECTIONS) if any(layout.degrees(facts)) else set()
    fitting = facts._replace(size=None) if any(statics.volume(facts)) else facts
    findings = [
        finding
        for rule in _RULES
        if rule not in consequences
        for finding in rule(facts if rule is statics.volume else fitting)
    ]
    return tuple(sorted(findings, key=lambda finding: finding.level != "error"))


def derived(facts: Facts) -> tuple[tuple[str, str, str], ...]:
    """Rows (what, value, unit)."""
    eigenvalues = np.linalg.eigvalsh(0.5 * (facts.mass_matrix + facts.mass_matrix.T))
    sizes = np.linalg.svd(facts.thruster_matrix, compute_uv=False)
    even = np.linalg.svd(scaled(facts.thruster_matrix), compute_uv=False)
    rank = int((sizes > 1e-9 * sizes[0]).sum())
    drag = np.diag(facts.linear_damping) + np.diag(facts.quadratic_damping)
    righting = facts.weight * facts.r_g[2] - facts.buoyancy * facts.r_b[2]
    return (
        ("mass, displaced mass", _row([facts.mass, facts.displaced_mass]), "kg"),
        ("(B - W) / W", f"{100 * (facts.buoyancy / facts.weight - 1):+.2f}", "%"),
        ("radii of gyration, roll, pitch, yaw", _row(facts.radii_of_gyration), "m"),
        ("eigenvalues of M", _row(eigenvalues), "kg, kg m^2"),
        ("added mass / displaced mass", _row(np.diag(facts.added_mass)[:3] / facts.displaced_mass), ""),
        ("drag at 1 m/s, surge, sway, heave", _row(drag[:3]), "N"),
        ("centre of buoyancy above centre of gravity", f"{1e3 * (facts.r_g[2] - facts.r_b[2]):.4g}", "mm"),
        ("righting moment", f"{righting:.4g}", "N m/rad"),
        ("thrusters, rank of their matrix", f"{len(facts.positions)}, {rank}", ""),
        ("singular values of the thruster matrix", _row(sizes), ""),
        ("condition, moments per longest arm", f"{even[0] / even[-1]:.3g}" if len(even) == rank == 6 else "-", ""),
    )


def _row(values) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def vehicle_facts(plant: AbstractPlant, description: Mapping[str, Any]) -> Facts | None:
    """Facts of the vehicle of a plant, with the thrusters that it runs with; None for a plant that is no vehicle.

    Args:
        plant: of a scenario, as built.
        description: key `plant` of the scenario with all defaults filled in.
    """
    vehicle = getattr(plant, "vehicle", None)
    if not isinstance(vehicle, VehicleModel):
        return None
    file = description.get("vehicle", {}).get("contents", {})
    further_facts: dict[str, Any] = {
        key: np.asarray(file[key], dtype=float) for key in ("size", "water_density") if key in file
    }
    if file:
        further_facts["angles"] = angles_of(file["thrusters"])
    if "thruster_matrix" in file:
        running = [number - 1 for number in description.get("thrusters") or range(1, vehicle.thrusters + 1)]
        further_facts["printed_matrix"] = np.asarray(file["thruster_matrix"], dtype=float)[:, running]
    return facts_of(vehicle)._replace(**further_facts)


_SHOWN = ("gravity", "degrees", "arm")  # advice that matters before a run


def vehicle_advice(built: Built) -> tuple[Advice, ...]:
    """What matters before a run: impossible properties, wrong units, and a weight that is not that of the mass.

    A weight differs where only the mass is changed, in a scenario or from trial to trial.
    """
    description = built.resolved["plant"]
    facts = vehicle_facts(built.closed_loop.plant, description)
    findings = () if facts is None else lint(facts)
    findings_shown = [finding for finding in findings if finding.level == "error" or finding.rule in _SHOWN]
    changes = description.get("vehicle", {})
    if "mass" in changes and "weight" not in changes:
        stays = "With `mass` alone changed, weight and buoyancy stay: give `weight` and `buoyancy`, too"
        findings_shown = [
            finding._replace(hint=stays) if finding.rule == "gravity" else finding for finding in findings_shown
        ]
    with error_location("plant.vehicle", vehicle_location(built.text)):
        return tuple(advice(finding.key, finding.says, finding.hint) for finding in findings_shown)
