"""I6, I7: where a motor's power goes, what it does at rest, and the misprint in k_2."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import DCMotor, paper_table3
from undertow.physics.vehicles import odin

PAPER = paper_table3("electromechanical")
MOTOR = PAPER.motor
CONSTANTS = dict(
    resistance=0.36,
    inductance=1e-3,
    torque_constant=0.0195,
    back_emf_constant=0.0195,
    friction=1e-4,
    rotor_inertia=2e-5,
    thrust_coefficient=3.7e-4,
    torque_coefficient=3.45e-6,
)
RNG = np.random.default_rng(6)
SPEED, CURRENT, VOLTS = (scale * RNG.normal(size=(200, 8)) for scale in (40.0, 10.0, 15.0))


def test_table_3_gains():
    """k_1, k_2, k_3, c_tq and alpha to the digits of the theory."""
    found = [MOTOR.k1, MOTOR.k2, MOTOR.k3, MOTOR.torque_per_thrust, MOTOR.voltage_gain]
    np.testing.assert_allclose(found, [0.009449, 0.06755, 0.9449, 0.0619, 17.11], rtol=6e-4)


@pytest.mark.parametrize("constants", [None, CONSTANTS], ids=["paper", "consistent"])
def test_power_goes_into_heat_winding_rotor_and_water(constants):
    """V I = R I^2 + d(L I^2/2)/dt + k_e Om I and k_t I Om = d(J Om^2/2)/dt + (k_f Om + Q) Om."""
    motor = MOTOR if constants is None else DCMotor(**constants)
    thruster = type(PAPER)(motor=motor)

    def terms(speed, current, volts):
        state = thruster.initial_state(8)._replace(speed=speed, current=current)
        rates = thruster.dynamics(state, volts)

        def rate_of(stored):
            return jax.jvp(stored, (state,), (rates,))[1]

        winding = rate_of(lambda s: motor.inductance * s.current**2 / 2)
        rotor = rate_of(lambda s: motor.rotor_inertia * s.speed**2 / 2)
        heat, converted = motor.resistance * current**2, motor.back_emf_constant * speed * current
        friction, water = motor.friction * speed**2, motor.torque(speed) * speed
        electrical = jnp.stack([-volts * thruster.current(state, volts), heat, winding, converted])
        mechanical = jnp.stack([-motor.torque_constant * current * speed, rotor, friction, water])
        return electrical, mechanical

    for balance in map(np.asarray, jax.jit(jax.vmap(terms))(SPEED, CURRENT, VOLTS)):
        assert (np.abs(balance.sum(1)) <= 1e-8 * np.abs(balance).max(1)).all()


def test_power_of_the_plant_is_volts_times_amperes():
    plant = hybrid_vehicle(odin(), PAPER)
    x = plant.initial_state()
    x = x._replace(thrusters=x.thrusters._replace(current=CURRENT[0]))
    np.testing.assert_allclose(
        jax.jit(lambda x, volts: plant.effort(x, volts).power)(x, VOLTS[0]), VOLTS[0] * CURRENT[0], rtol=1e-15
    )


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.floats(0.5, 2.0))
def test_torque_and_back_emf_constants_that_disagree_are_pointed_out(ratio):
    motor = DCMotor(**{**CONSTANTS, "torque_constant": ratio * CONSTANTS["back_emf_constant"]})
    assert bool(motor.advice()) == (abs(ratio - 1) > 0.05)


def test_advice_names_the_ratio_and_the_worst_of_several_motors():
    assert "117" in MOTOR.advice()[0]
    assert "117" in hybrid_vehicle(odin(), PAPER).advice()[0]
    mixed = DCMotor(**{**CONSTANTS, "torque_constant": 0.0195 * np.array([1.0, 1.04, 0.5, 1.3])})
    assert "0.5" in mixed.advice()[0]


voltages = np.concatenate([-np.logspace(-6, 3, 100)[::-1], np.zeros(1), np.logspace(-6, 3, 100)])
steady_speed, steady_current, thrust = map(
    eqx.filter_jit, (DCMotor.steady_speed, DCMotor.steady_current, DCMotor.thrust)
)


@pytest.mark.parametrize("motor", [MOTOR, DCMotor(**CONSTANTS)], ids=["paper", "consistent"])
def test_steady_speed_solves_its_equation_is_odd_and_rises_with_voltage(motor):
    speed = np.asarray(steady_speed(motor, voltages))
    quadratic = float(motor.k3 * motor.torque_coefficient)
    residual = quadratic * speed * np.abs(speed) + float(motor.k2) * speed - voltages
    assert (np.abs(residual) <= 1e-9 * np.maximum(np.abs(voltages), 1e-6)).all()
    np.testing.assert_array_equal(speed, -speed[::-1])
    assert (np.diff(speed) > 0).all()
    for volts in (0.01, 3.0, 24.0):
        by_search = brentq(lambda w, volts=volts: quadratic * w * w + float(motor.k2) * w - volts, 0, 1e5, xtol=1e-13)
        np.testing.assert_allclose(steady_speed(motor, np.asarray(volts)), by_search, rtol=1e-9)


def test_steady_current_is_what_ohms_law_leaves():
    """V = R I + k_e Om at rest: Eqs. (8) and (9) agree on the steady state."""
    speed = np.asarray(steady_speed(MOTOR, voltages))
    left = (voltages - np.asarray(MOTOR.back_emf_constant) * speed) / np.asarray(MOTOR.resistance)
    np.testing.assert_allclose(steady_current(MOTOR, speed), left, rtol=1e-9)


@pytest.mark.parametrize(("volts", "newtons"), [(5, 45), (10, 108.8), (12, 136), (24, 306)])
def test_steady_thrust_of_table_3(volts, newtons):
    found = thrust(MOTOR, steady_speed(MOTOR, np.asarray(float(volts))))
    np.testing.assert_allclose(found, newtons, rtol=0, atol=0.05 if volts == 10 else 0.5)


def test_misprint_in_k2_would_give_a_third_more_thrust():
    """With k_e in place of k_f, as printed after Eq. (13), 10 V would give 148.3 N; the motor gives 108.8 N."""
    k_t, k_e, resistance = map(float, (MOTOR.torque_constant, MOTOR.back_emf_constant, MOTOR.resistance))
    printed = float(MOTOR.k3) * (k_t * k_e / resistance + k_e)
    np.testing.assert_allclose(printed, 0.02112, rtol=3e-3)
    quadratic = float(MOTOR.k3 * MOTOR.torque_coefficient)
    speed = (-printed + np.sqrt(printed**2 + 40 * quadratic)) / (2 * quadratic)
    np.testing.assert_allclose(thrust(MOTOR, np.asarray(speed)), 148.3, rtol=0, atol=0.05)

    @jax.jit
    def rates_at_rest(volts):
        speed = MOTOR.steady_speed(volts)
        state = PAPER.initial_state(1)._replace(speed=speed, current=MOTOR.steady_current(speed))
        return PAPER.dynamics(state, volts)

    rates = rates_at_rest(np.array([10.0]))
    np.testing.assert_allclose([rates.speed[0], rates.current[0]], 0.0, atol=1e-9)
