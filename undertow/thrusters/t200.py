"""Blue Robotics T200: one brushed-DC equivalent for the manufacturer's whole table, 10-20 V."""

from undertow.thrusters.ladder import on_rung
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.thruster import AbstractThruster

_TABLE = "fit to the manufacturer's table of September 2019, 10-20 V, 1206 rows (benchmarks/fit_t200.py)"


def t200(rung: str = "shaft", supply: float = 16.0, dead_zone: float = 1.2) -> AbstractThruster:
    """Blue Robotics T200 on a rung of the fidelity ladder: within 2.5 N, 0.8 A and 15 rad/s rms of its table.

    A motor with k_t = k_e. The bench: duty = (PWM - 1500) / 400, V = duty times supply. How the loss divides into
    copper and shaft cannot be read from such a table; this set gives the propeller a credible figure of merit of 0.65
    at full thrust.
    Not modelled: limits of current (25 A continuous; 32 A were measured at 20 V) and power (350 W), heat.
    With an inductance of 0.154 mH the winding settles in 0.4 ms: on `electromechanical` take steps of 0.2 ms.

    Args:
        rung: ideal, static, shaft or electromechanical.
        supply: voltage limit, V; the table ends at 20 V.
        dead_zone: voltage below which nothing turns, V; the table's bands are 1.0 to 1.4 V.
    """
    motor = DCMotor(
        resistance=0.3535,
        inductance=1.54e-4,
        torque_constant=0.02124,
        back_emf_constant=0.02124,
        friction=0.0,
        rotor_inertia=2.69e-4,
        thrust_coefficient=3.759e-4,
        torque_coefficient=3.945e-6,
        reverse_thrust_coefficient=2.943e-4,
        sources={
            "*": _TABLE,
            "inductance": "data sheet of the motor: 0.077 mH per phase, twice",
            "friction": "not identifiable from the table; counted as propeller torque",
            "rotor_inertia": "not published; chosen for a time constant of 0.1 s about half of the full speed at 16 V",
            "reverse_torque_coefficient": "as forward: the table shows no difference that matters",
        },
    )
    return on_rung(motor, rung, supply, dead_zone)
