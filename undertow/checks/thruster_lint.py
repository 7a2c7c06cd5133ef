"""Linter of thrusters: constants of the motor, and thrust at full voltage."""

from collections.abc import Iterator
from typing import Any

import jax.numpy as jnp
import numpy as np

from undertow.checks.finding import Finding, error
from undertow.checks.part_check import check_contract
from undertow.checks.thruster_check import full_voltage, settled_thrust
from undertow.thrusters.motor import DCMotor
from undertow.thrusters.thruster import AbstractThruster


def lint_thruster(thruster: AbstractThruster) -> tuple[Finding, ...]:
    """All errors and advice on a thruster."""
    broken = check_contract(thruster)
    return broken if any(finding.level == "error" for finding in broken) else (*broken, *_findings(thruster))


def _findings(thruster: AbstractThruster) -> Iterator[Finding]:
    for sentence in thruster.advice():
        yield Finding("advice", "motor", "thruster", sentence.rstrip("."))
    gain = float(np.min(thruster.voltage_gain()))
    if not gain > 0:
        yield error("gain", "voltage_gain", "be positive", f"{gain:.4g} N/V")
    at_rest = np.asarray(thruster.thrust(thruster.initial_state(1), jnp.zeros(1)))
    if np.any(at_rest):
        yield error("rest", "thrust", "be zero at rest without voltage", f"{at_rest.ravel()[0]:.4g} N")


def derived_of_thruster(thruster: AbstractThruster) -> tuple[tuple[str, str, str], ...]:
    """Rows (what, value, unit)."""
    supply, limit, unit = float(thruster.supply), full_voltage(thruster), thruster.input_unit
    rows = [
        (
            "supply, dead zone" if unit == "V" else "largest command, dead zone",
            _row([supply, thruster.dead_zone]),
            unit,
        ),
        ("gain of the linear model", f"{float(np.min(thruster.voltage_gain())):.4g}", f"N/{unit}"),
    ]
    motor = getattr(thruster, "motor", None)
    if isinstance(motor, DCMotor):
        rows += _of_motor(motor, limit, thruster.terminal(jnp.asarray([limit, -limit])))
    else:
        rows.append((f"steady thrust at +-{limit:g} {unit}", _row(settled_thrust(thruster, limit)), "N"))
    return tuple(rows)


def _of_motor(motor: DCMotor, limit: float, volts: Any) -> list[tuple[str, str, str]]:
    speed = motor.steady_speed(volts)
    powers = motor.powers(volts, motor.steady_current(speed), speed)
    share = np.asarray((powers.water + powers.friction) / powers.source)
    # R J / (k_t (k_2 + 2 k_3 c_q Om)): time constant of the speed near this speed.
    slope = motor.k2 + 2 * motor.k3 * motor.torque_coefficient * speed[0]
    return [
        ("torque constant / back-EMF constant", f"{float(motor.torque_constant / motor.back_emf_constant):.4g}", ""),
        (f"thrust at +-{limit:g} V", _row(motor.thrust(speed)), "N"),
        (f"speed at +-{limit:g} V", _row(speed), "rad/s"),
        (f"current at +-{limit:g} V", _row(motor.steady_current(jnp.abs(speed))), "A"),
        ("shaft power / electrical power", _row(share), ""),
        (f"time constant of the speed at {limit:g} V", f"{float(motor.k1 / slope):.3g}", "s"),
    ]


def _row(values) -> str:
    return ", ".join(f"{value:.4g}" for value in np.asarray(values))
