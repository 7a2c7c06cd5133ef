"""Blue Robotics T500: one brushed DC motor fitted to the manufacturer's plot data at 16 V and 24 V."""

from undertow.core import checks
from undertow.physics.thrusters.fidelity_levels import with_fidelity
from undertow.physics.thrusters.motor import DCMotor
from undertow.physics.thrusters.thruster import DEAD_ZONES, AbstractThruster

_TABLE = "fit to the manufacturer's plot data, 16 V and 24 V, 402 rows (benchmarks/fit_t200.py t500)"

# k_t = k_e, R, c_q, c_t, c_t and c_q in reverse, J; by kind of dead zone.
_FITS = {
    "pass": (0.03288, 0.3135, 1.405e-5, 1.571e-3, 9.609e-4, 1.280e-5, 7.92e-4),
    "subtract": (0.01815, 0.3791, 8.325e-6, 1.578e-3, 9.601e-4, 7.668e-6, 3.48e-4),
}


def t500(
    fidelity: str = "shaft", supply: float = 24.0, dead_zone: float = 1.2, dead_zone_kind: str = "pass"
) -> AbstractThruster:
    """Blue Robotics T500 at a fidelity level: within 2.5 N, 1 A and 6 rad/s rms of its data.

    A motor with k_t = k_e. The only source has doubtful labels: two different arrays are both named 12 V, and the 20 V
    curve has a jump. Only 16 V and 24 V are used here; each alone would be fitted by another R and k_e (0.34 ohm and
    0.032 V s/rad at 16 V, 0.37 ohm and 0.026 V s/rad at 24 V), so the division of the loss is uncertain.
    Each kind of dead zone has constants of its own; `subtract` fits the data less well: 2.76 N, 0.99 A and 8.2 rad/s
    rms (`pass`: 2.06 N, 0.87 A and 5.1 rad/s).
    Not modelled: limits of current and power.

    Args:
        fidelity: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; the data end at 24 V.
        dead_zone: voltage below which the thrust is zero, V.
        dead_zone_kind: effect of a voltage outside it: pass, all of it, or subtract, its part beyond the zone.
    """
    checks.choice("dead_zone_kind", dead_zone_kind, DEAD_ZONES)
    back_emf, resistance, torque, thrust, reverse_thrust, reverse_torque, inertia = _FITS[dead_zone_kind]
    motor = DCMotor(
        resistance=resistance,
        inductance=1.4e-4,
        torque_constant=back_emf,
        back_emf_constant=back_emf,
        friction=0.0,
        rotor_inertia=inertia,
        thrust_coefficient=thrust,
        torque_coefficient=torque,
        reverse_thrust_coefficient=reverse_thrust,
        reverse_torque_coefficient=reverse_torque,
        sources={
            "*": _TABLE,
            "inductance": "not published; L / R as in the T200",
            "friction": "not identifiable from the data; counted as propeller torque",
            "rotor_inertia": "not published; chosen for a time constant of 0.1 s about half of the full speed at 24 V",
        },
        tested_voltage=24.0,
    )
    return with_fidelity(motor, fidelity, supply, dead_zone, dead_zone_kind)
