"""Fidelity levels of a DC-motor thruster."""

import jax.numpy as jnp

from undertow.core import checks
from undertow.thrusters.electromechanical import ElectromechanicalThruster
from undertow.thrusters.ideal import IdealThruster
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.shaft import ShaftThruster
from undertow.thrusters.static import StaticThruster
from undertow.thrusters.thruster import AbstractThruster

FIDELITIES = {
    "ideal": IdealThruster,
    "static": StaticThruster,
    "shaft": ShaftThruster,
    "electromechanical": ElectromechanicalThruster,
}


def with_fidelity(
    motor: DCMotor, fidelity: str, supply: float = float(jnp.inf), dead_zone: float = 0.0, dead_zone_kind: str = "pass"
) -> AbstractThruster:
    """Thruster with a DC motor at a fidelity level.

    Args:
        motor: constants.
        fidelity: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; infinite by default.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.

    Raises:
        BadInput: unknown fidelity or kind, supply not positive, dead zone negative, or no inductance at
            `electromechanical`.
    """
    checks.choice("fidelity", fidelity, tuple(FIDELITIES))
    if not supply > 0:
        checks.positive("supply", supply, "V")
    if fidelity == "electromechanical":
        checks.positive("inductance", motor.inductance, "H")
    return FIDELITIES[fidelity](motor=motor, supply=supply, dead_zone=dead_zone, dead_zone_kind=dead_zone_kind)
