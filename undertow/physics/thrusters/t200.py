"""Blue Robotics T200: one brushed DC motor fitted to all of the manufacturer's table, 10-20 V."""

from undertow.core import checks
from undertow.physics.thrusters.fidelity_levels import with_fidelity
from undertow.physics.thrusters.motor import DCMotor
from undertow.physics.thrusters.thruster import DEAD_ZONES, AbstractThruster

_TABLE = "fit to the manufacturer's table of September 2019, 10-20 V, 1206 rows (benchmarks/fit_t200.py)"

# k_t = k_e, R, c_q, c_t, c_t in reverse, J; by kind of dead zone.
_FITS = {
    "pass": (0.02124, 0.3535, 3.945e-6, 3.759e-4, 2.943e-4, 2.69e-4),
    "subtract": (0.008255, 0.4615, 1.705e-6, 3.777e-4, 2.958e-4, 7.5e-5),
}


def t200(
    fidelity: str = "shaft", supply: float = 16.0, dead_zone: float = 1.2, dead_zone_kind: str = "pass"
) -> AbstractThruster:
    """Blue Robotics T200 at a fidelity level: within 2.5 N, 0.8 A and 15 rad/s rms of its table.

    A motor with k_t = k_e. Test bench: duty = (PWM - 1500) / 400, V = duty times supply. The table does not determine
    how the loss divides into copper and shaft; this set gives the propeller a plausible figure of merit of 0.65 at
    full thrust, and R and k_e within 2 and 9 % of the motor's data sheet.
    Each kind of dead zone has constants of its own. `subtract` fits the table less well (2.32 N and 0.65 A rms, `pass`
    2.20 N and 0.63 A) with an impossible figure of merit of 1.5. Up to 4 V its thrust fits better, 0.42 N rms (`pass`
    0.57 N). Use it to test a law with a dead zone that reduces the voltage.
    Not modelled: limits of current (25 A continuous; 32 A were measured at 20 V) and power (350 W), heat.
    With an inductance of 0.154 mH the winding settles in 0.4 ms: at `electromechanical` use steps of 0.2 ms.

    Args:
        fidelity: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; the table ends at 20 V.
        dead_zone: voltage below which the thrust is zero, V; the table's bands are 1.0 to 1.4 V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.
    """
    checks.choice("dead_zone_kind", dead_zone_kind, DEAD_ZONES)
    back_emf, resistance, torque, thrust, reverse_thrust, inertia = _FITS[dead_zone_kind]
    motor = DCMotor(
        resistance=resistance,
        inductance=1.54e-4,
        torque_constant=back_emf,
        back_emf_constant=back_emf,
        friction=0.0,
        rotor_inertia=inertia,
        thrust_coefficient=thrust,
        torque_coefficient=torque,
        reverse_thrust_coefficient=reverse_thrust,
        sources={
            "*": _TABLE,
            "inductance": "data sheet of the motor: 0.077 mH per phase, twice",
            "friction": "not identifiable from the table; counted as propeller torque",
            "rotor_inertia": "not published; chosen for a time constant of 0.1 s about half of the full speed at 16 V",
            "reverse_torque_coefficient": "as forward: the table shows no significant difference",
        },
        tested_voltage=20.0,
    )
    return with_fidelity(motor, fidelity, supply, dead_zone, dead_zone_kind)
