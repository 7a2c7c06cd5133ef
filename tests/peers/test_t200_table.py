"""T200 and T500 against every row of the manufacturer's tables, with one set of constants for all supply voltages.

data/t200_table.csv and t500_table.csv: supply (V), PWM (us), propeller speed (rad/s), supply current (A), thrust (N),
from the manufacturer's public performance data (T200, September 2019; T500, plot data of the product page).
"""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.thrusters import t200, t500

DATA = Path(__file__).parent / "data"


def misfit(thruster, name):
    """Rms over all rows of speed (rad/s), current from the supply (A) and thrust (N); and the rows."""
    supply, pwm, *measured = np.loadtxt(DATA / f"{name}_table.csv", delimiter=",", skiprows=1, unpack=True)
    duty = (pwm - 1500) / 400
    volts = jnp.asarray(duty * supply)
    speed = thruster.motor.steady_speed(thruster.terminal(volts))
    modelled = speed, thruster.current((), volts) * duty, thruster.thrust((), volts)
    rms = [float(np.sqrt(np.mean((m - t) ** 2))) for m, t in zip(modelled, measured, strict=True)]
    return rms, len(pwm)


# Bars of the T200: 2.5 N, 0.8 A, 15 rad/s. Those of the T500 are its own fit, rounded up.
@pytest.mark.parametrize(
    ("part", "name", "rows", "bars"),
    [(t200, "t200", 1206, (15.0, 0.8, 2.5)), (t500, "t500", 402, (6.0, 1.0, 2.5))],
    ids=["t200", "t500"],
)
def test_whole_table_with_one_set_of_constants(part, name, rows, bars):
    rms, count = misfit(part("static"), name)
    print(f"{name}, {count} rows: speed {rms[0]:.2f} rad/s, current {rms[1]:.3f} A, thrust {rms[2]:.2f} N rms")
    assert count == rows
    assert all(np.array(rms) <= bars), rms


@pytest.mark.parametrize("part", [t200, t500], ids=["t200", "t500"])
def test_the_motor_gives_no_more_than_it_takes(part):
    motor = part("static").motor
    assert motor.torque_constant == motor.back_emf_constant
    assert not motor.advice()


@pytest.mark.parametrize("part", [t200, t500], ids=["t200", "t500"])
def test_time_constant_about_half_speed_is_a_tenth_of_a_second(part):
    """k_1 / (k_2 + 2 k_3 c_q Om) at half of the full speed."""
    thruster = part("shaft")
    motor = thruster.motor
    half = float(motor.steady_speed(thruster.terminal(thruster.supply))) / 2
    constant = motor.k1 / (motor.k2 + 2 * motor.k3 * motor.torque_coefficient * half)
    np.testing.assert_allclose(constant, 0.1, rtol=2e-3)
