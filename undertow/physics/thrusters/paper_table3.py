"""The paper's thruster: the DC motor of its Table 3."""

import math

from undertow.physics.thrusters.fidelity_levels import with_fidelity
from undertow.physics.thrusters.motor import DCMotor
from undertow.physics.thrusters.thruster import AbstractThruster


def paper_table3(
    fidelity: str = "electromechanical",
    supply: float = math.inf,
    dead_zone: float = 0.0,
    dead_zone_kind: str = "pass",
    inductance: float = 0.01,
) -> AbstractThruster:
    """Thruster of Table 3, as printed, at a fidelity level.

    The motor is physically impossible: k_t / k_e is 117, so the shaft gives several times the power of the supply.

    Args:
        fidelity: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; infinite by default.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.
        inductance: of the winding, H; Table 3 prints 0.01. It decides whether Table 1 is stable.
    """
    motor = DCMotor(
        resistance=1.2,
        inductance=inductance,
        torque_constant=1.27,
        back_emf_constant=0.01086,
        friction=0.06,
        rotor_inertia=0.01,
        thrust_coefficient=0.0375,
        torque_coefficient=0.00232,
        sources={"*": "the paper, Table 3", "friction": "the paper, Table 3 (unit printed as N s)"},
    )
    return with_fidelity(motor, fidelity, supply, dead_zone, dead_zone_kind)
