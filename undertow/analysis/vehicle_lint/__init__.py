"""Is this vehicle possible, and is it likely? Each rule looks at one thing and says what caused its finding.

A linter sees numbers, not code. Of the defects found in published models it cannot see: integration errors and time
steps (tests/loop/test_sampled_to_continuous.py: the answer converges as the step is halved), wrong kinematics
(tests/numerics/test_rotations.py), Coriolis terms left out (tests/physics/test_inertia_forces.py), motion reversed
or mirrored (tests/physics/test_symmetries.py), energy out of nothing (tests/physics/test_energy_balance.py),
state that leaks between runs (tests/cli/test_simulate.py: a repeated run has the same bits).
"""

from undertow.analysis.finding import Finding
from undertow.analysis.vehicle_lint import copied, hydrodynamics, layout, mass, printed_matrix, statics
from undertow.analysis.vehicle_lint.derived import derived as derived
from undertow.analysis.vehicle_lint.facts import Facts as Facts
from undertow.analysis.vehicle_lint.facts import facts_of as facts_of

_RULES = (
    *mass.RULES,
    *statics.RULES,
    *hydrodynamics.RULES,
    *layout.RULES,
    *printed_matrix.RULES,
    *copied.RULES,
)


def lint(facts: Facts) -> tuple[Finding, ...]:
    """Everything that is wrong or odd about a vehicle, errors first."""
    findings = [finding for rule in _RULES for finding in rule(facts)]
    return tuple(sorted(findings, key=lambda finding: finding.level != "error"))
