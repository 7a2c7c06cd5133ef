"""T200 and T500 against every row of the manufacturer's tables, with one set of constants for all supply voltages.

data/t200_table.csv and t500_table.csv: supply (V), PWM (us), propeller speed (rad/s), supply current (A), thrust (N),
from the manufacturer's public performance data (T200, September 2019; T500, plot data of the product page).
"""

import importlib.util
from pathlib import Path

import equinox as eqx
import numpy as np
import pytest

from undertow.physics.thrusters import t200, t500

ROOT, DATA = Path(__file__).parents[2], Path(__file__).parent / "data"
LETTERS = {
    "k_e": "back_emf_constant",
    "R": "resistance",
    "c_q": "torque_coefficient",
    "c_t": "thrust_coefficient",
    "c_t_reverse": "reverse_thrust_coefficient",
    "c_q_reverse": "reverse_torque_coefficient",
    "J": "rotor_inertia",
}


def table(name):
    """Columns."""
    return np.loadtxt(DATA / f"{name}_table.csv", delimiter=",", skiprows=1, unpack=True)


@eqx.filter_jit
def steady(thruster, volts):
    """Speed, electrical power and thrust."""
    speed = thruster.motor.steady_speed(thruster.terminal(volts))
    return speed, thruster.electrical_power((), volts), thruster.thrust((), volts)


def misfit(thruster, name):
    """Rms over all rows of speed (rad/s), current from the supply (A) and thrust (N); and the rows."""
    supply, pwm, *measured = table(name)
    speed, power, thrust = map(np.asarray, steady(thruster, (pwm - 1500) / 400 * supply))
    modelled = speed, power / supply, thrust
    rms = [float(np.sqrt(np.mean((m - t) ** 2))) for m, t in zip(modelled, measured, strict=True)]
    return rms, len(pwm)


# Bars of the T200: 2.5 N, 0.8 A, 15 rad/s. Those of the T500 are its own fit, rounded up.
@pytest.mark.parametrize(
    ("part", "name", "rows", "bars"),
    [(t200, "t200", 1206, (15.0, 0.8, 2.5)), pytest.param(t500, "t500", 402, (6.0, 1.0, 2.5), marks=pytest.mark.full)],
    ids=["t200", "t500"],
)
def test_whole_table_with_one_set_of_constants(part, name, rows, bars):
    rms, count = misfit(part("static"), name)
    print(f"{name}, {count} rows: speed {rms[0]:.2f} rad/s, current {rms[1]:.3f} A, thrust {rms[2]:.2f} N rms")
    assert count == rows
    assert all(np.array(rms) <= bars), rms


@pytest.mark.parametrize(
    ("part", "name", "subtracting"),
    [(t200, "t200", (13.6, 0.651, 2.32)), (t500, "t500", (8.23, 0.988, 2.76))],
    ids=["t200", "t500"],
)
def test_the_dead_zone_that_passes_the_whole_voltage_meets_the_table_better(part, name, subtracting):
    """Each kind with the constants that fit it best; current and thrust of both parts, the speed of the T500."""
    (passing, _), (found, _) = (misfit(part("static", dead_zone_kind=kind), name) for kind in ("pass", "subtract"))
    print(f"{name}: pass {np.round(passing, 3)}, subtract {np.round(found, 3)} (rad/s, A, N)")
    np.testing.assert_allclose(found, subtracting, rtol=3e-3)
    assert passing[1] < found[1] and passing[2] < found[2]
    assert part().dead_zone_kind == "pass"


@pytest.mark.parametrize(("part", "name"), [(t200, "t200"), (t500, "t500")], ids=["t200", "t500"])
def test_dead_band_in_pulses_and_direction(part, name):
    """Whatever the supply: the last pulse without thrust, to two rows (8 us) of the table; rising; weaker in reverse."""
    thruster, (supply, pwm, _, _, thrust) = part("static"), table(name)
    modelled_thrust = np.asarray(steady(thruster, (pwm - 1500) / 400 * supply)[2])
    for bus in np.unique(supply):
        rows = supply == bus
        found = modelled_thrust[rows]
        bands = [pwm[rows][of == 0.0] for of in (found, thrust[rows])]
        assert abs(bands[0].min() - bands[1].min()) <= 8 and abs(bands[0].max() - bands[1].max()) <= 8, bus
        rising = np.diff(found[np.argsort(pwm[rows])])
        inside = (found == 0.0)[np.argsort(pwm[rows])]
        assert (rising[~(inside[1:] & inside[:-1])] > 0).all()
        measured, modelled = (-of[pwm[rows] == 1100] / of[pwm[rows] == 1900] for of in (thrust[rows], found))
        np.testing.assert_allclose(modelled, measured, atol=0.05)


@pytest.mark.parametrize("kind", ["pass", "subtract"])
@pytest.mark.parametrize("name", ["t200", "t500"])
def test_constants_are_those_of_the_fit(name, kind):
    """benchmarks/fit_t200.py, run again, to the four digits that are written in the package."""
    spec = importlib.util.spec_from_file_location("fit_t200", ROOT / "benchmarks" / "fit_t200.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    found, motor = script.main(name, kind), {"t200": t200, "t500": t500}[name](dead_zone_kind=kind).motor
    for letter, constant in LETTERS.items():
        if letter in found:
            np.testing.assert_allclose(getattr(motor, constant), found[letter], rtol=2e-3, err_msg=letter)


@pytest.mark.parametrize("part", [t200, t500], ids=["t200", "t500"])
def test_the_motor_gives_no_more_than_it_takes(part):
    motor = part("static").motor
    assert motor.torque_constant == motor.back_emf_constant
    assert not motor.advice()


@pytest.mark.parametrize("kind", ["pass", "subtract"])
@pytest.mark.parametrize("part", [t200, t500], ids=["t200", "t500"])
def test_time_constant_about_half_speed_is_a_tenth_of_a_second(part, kind):
    """k_1 / (k_2 + 2 k_3 c_q Om) at half of the full speed."""
    thruster = part("shaft", dead_zone_kind=kind)
    motor = thruster.motor
    half = float(motor.steady_speed(thruster.terminal(thruster.supply))) / 2
    constant = motor.k1 / (motor.k2 + 2 * motor.k3 * motor.torque_coefficient * half)
    np.testing.assert_allclose(constant, 0.1, rtol=2e-3)
