"""A thruster given by the constants of its motor and propeller."""

import math

from undertow.physics.thrusters.fidelity_levels import with_fidelity
from undertow.physics.thrusters.motor import DCMotor
from undertow.physics.thrusters.thruster import AbstractThruster


def dc_motor(
    resistance: float = 0.3535,
    back_emf_constant: float = 0.02124,
    thrust_coefficient: float = 3.759e-4,
    torque_coefficient: float = 3.945e-6,
    rotor_inertia: float = 2.69e-4,
    torque_constant: float | None = None,
    reverse_thrust_coefficient: float | None = None,
    reverse_torque_coefficient: float | None = None,
    friction: float = 0.0,
    inductance: float = 0.0,
    fidelity: str = "shaft",
    supply: float = math.inf,
    dead_zone: float = 0.0,
    dead_zone_kind: str = "pass",
) -> AbstractThruster:
    """A DC motor with a propeller, from your own constants: of data sheets, or of `undertow identify --thruster`.

    Default constants are those of `t200`, forward.

    Args:
        resistance: of the winding, ohm.
        back_emf_constant: k_e, V s/rad.
        thrust_coefficient: thrust per speed squared, N s^2/rad^2.
        torque_coefficient: torque of the propeller per speed squared, N m s^2/rad^2.
        rotor_inertia: of rotor, propeller and the water that turns with it, kg m^2.
        torque_constant: k_t, N m/A; None for the same number as k_e, as in any DC motor.
        reverse_thrust_coefficient: thrust per speed squared in reverse, N s^2/rad^2; None for that of forward motion.
        reverse_torque_coefficient: torque per speed squared in reverse, N m s^2/rad^2; None for that of forward motion.
        friction: viscous, N m s/rad.
        inductance: of the winding, H; positive at fidelity electromechanical.
        fidelity: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; infinite by default.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.
    """
    motor = DCMotor(
        resistance=resistance,
        inductance=inductance,
        torque_constant=back_emf_constant if torque_constant is None else torque_constant,
        back_emf_constant=back_emf_constant,
        friction=friction,
        rotor_inertia=rotor_inertia,
        thrust_coefficient=thrust_coefficient,
        torque_coefficient=torque_coefficient,
        reverse_thrust_coefficient=reverse_thrust_coefficient,
        reverse_torque_coefficient=reverse_torque_coefficient,
        sources={"*": "options of the thruster"},
    )
    return with_fidelity(motor, fidelity, supply, dead_zone, dead_zone_kind)
