"""The fidelity ladder: one motor, four degrees of truth."""

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
    motor: DCMotor,
    fidelity: str,
    supply: float = float(jnp.inf),
    dead_zone: float = 0.0,
    dead_zone_kind: str = "pass",
) -> AbstractThruster:
    """The motor on a fidelity of the ladder.

    Args:
        motor: constants.
        fidelity: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; infinite by default.
        dead_zone: voltage below which nothing turns, V.
        dead_zone_kind: what is left of a voltage outside it: pass, the whole, or subtract, what is beyond it.

    Raises:
        BadInput: unknown fidelity or kind, supply not positive, dead zone negative, or no inductance on
            `electromechanical`.
    """
    checks.choice("fidelity", fidelity, tuple(FIDELITIES))
    if not supply > 0:
        checks.positive("supply", supply, "V")
    if fidelity == "electromechanical":
        checks.positive("inductance", motor.inductance, "H")
    return FIDELITIES[fidelity](motor=motor, supply=supply, dead_zone=dead_zone, dead_zone_kind=dead_zone_kind)
