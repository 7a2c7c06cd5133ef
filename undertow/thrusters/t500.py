"""Blue Robotics T500: one brushed-DC equivalent for the manufacturer's plot data at 16 V and 24 V."""

from undertow.thrusters.ladder import on_rung
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.thruster import AbstractThruster

_TABLE = "fit to the manufacturer's plot data, 16 V and 24 V, 402 rows (benchmarks/fit_t200.py t500)"


def t500(rung: str = "shaft", supply: float = 24.0, dead_zone: float = 1.2) -> AbstractThruster:
    """Blue Robotics T500 on a rung of the fidelity ladder: within 2.5 N, 1 A and 6 rad/s rms of its data.

    A motor with k_t = k_e. One source only, and it labels its curves badly: two different arrays are both named 12 V,
    the 20 V curve has a jump. Only 16 V and 24 V are used here; each alone would be fitted by another R and k_e
    (0.34 ohm and 0.032 V s/rad at 16 V, 0.37 ohm and 0.026 V s/rad at 24 V): how the loss divides is not known well.
    Not modelled: limits of current and power.

    Args:
        rung: ideal, static, shaft or electromechanical.
        supply: voltage limit, V.
        dead_zone: voltage below which nothing turns, V.
    """
    motor = DCMotor(
        resistance=0.3135,
        inductance=1.4e-4,
        torque_constant=0.03288,
        back_emf_constant=0.03288,
        friction=0.0,
        rotor_inertia=7.92e-4,
        thrust_coefficient=1.571e-3,
        torque_coefficient=1.405e-5,
        reverse_thrust_coefficient=9.609e-4,
        reverse_torque_coefficient=1.280e-5,
        sources={
            "*": _TABLE,
            "inductance": "not published; L / R as in the T200",
            "friction": "not identifiable from the data; counted as propeller torque",
            "rotor_inertia": "not published; chosen for a time constant of 0.1 s about half of the full speed at 24 V",
        },
    )
    return on_rung(motor, rung, supply, dead_zone)
