"""Linter of vehicles: whether the parameters are possible and plausible. Each rule checks one property.

A linter checks numbers, not code. Of the defects found in published models it cannot find: wrong integration and time
steps (tests/loop/test_sampled_to_continuous.py: answers converge as the step is halved; tests/numerics/
test_integrators.py), wrong kinematics (tests/numerics/test_rotations.py, tests/physics/test_output_rates.py), Coriolis
terms missing or doing work (tests/physics/test_inertia_forces.py), forces that change when motion is reversed or
mirrored (tests/physics/test_mirror.py), creation of energy (tests/physics/test_energy_balance.py), state that
leaks between runs (tests/loop/test_sampled_to_continuous.py: run twice, same bits).
"""

from undertow.checks.finding import Finding
from undertow.checks.vehicle_lint import copied, hydrodynamics, layout, mass, printed_matrix, statics
from undertow.checks.vehicle_lint.derived import derived as derived
from undertow.vehicles.facts import Facts as Facts
from undertow.vehicles.facts import facts_of as facts_of

_RULES = (
    *mass.RULES,
    *statics.RULES,
    *hydrodynamics.RULES,
    *layout.RULES,
    *printed_matrix.RULES,
    *copied.RULES,
)


def lint(facts: Facts) -> tuple[Finding, ...]:
    """All errors and advice on a vehicle, errors first."""
    findings = [finding for rule in _RULES for finding in rule(facts)]
    return tuple(sorted(findings, key=lambda finding: finding.level != "error"))
