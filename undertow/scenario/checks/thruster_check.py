"""Checks of a thruster: its contract, sign and gain of its thrust, constants of its motor, and numbers to look at."""

from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its parts are loaded when they are used
from jax.flatten_util import ravel_pytree

from undertow.physics.thrusters.motor import DCMotor
from undertow.physics.thrusters.thruster import AbstractThruster, Powers, PropellerReport
from undertow.scenario.checks.finding import Finding, advice, error, is_a, same_structure, shaped

_COUNT = 3  # thrusters at once, where any number will do: no other size that a part may happen to have
_VOLTAGE = 10.0  # V, where a thruster has no limit
_LONG = 60.0  # s, by when every thruster has settled
_FACTOR = 3.0  # between the gain the model takes and that at full voltage


def check_thruster(thruster: AbstractThruster) -> Iterator[Finding]:
    """Findings from every method, for three thrusters at different voltages, or as many as it has parameters for."""
    count = thruster.count() or _COUNT
    volts = _full_voltage(thruster) * jnp.resize(jnp.array([0.4, -0.7, 1.0]), (count,))
    state = thruster.initial_state(count)
    jax.eval_shape(thruster.dynamics, state, volts)  # raises if it does not compile
    jax.eval_shape(thruster.thrust, state, volts)
    per_thruster, scalar = (count,), ()
    powers, report = thruster.powers(state, volts), thruster.report(state)
    findings = [
        *same_structure("dynamics", thruster.dynamics(state, volts), state, "have the form of the state"),
        *shaped("thrust", thruster.thrust(state, volts), per_thruster),
        *shaped("current", thruster.current(state, volts), per_thruster),
        *shaped("stored", thruster.stored(state), per_thruster, scalar),
        *shaped("voltage_gain", thruster.voltage_gain(), scalar, per_thruster),
        *is_a("advice", thruster.advice(), tuple),
        *(is_a("powers", powers, Powers) if powers is not None else ()),
        *(is_a("report", report, PropellerReport) if report is not None else ()),
    ]
    for name, values in (("powers", powers), ("report", report)):
        if isinstance(values, Powers | PropellerReport):
            findings += [
                finding for value in values if value is not None for finding in shaped(name, value, per_thruster)
            ]
    if findings:
        yield from findings
        return
    full, gain = _full_voltage(thruster), float(np.min(thruster.voltage_gain()))
    forward, reverse = _settled_thrust(thruster, full)
    for thrust, volts, word in ((forward, full, "positive"), (-reverse, -full, "negative")):
        if not thrust > 0:
            got = f"{forward if volts > 0 else reverse:.4g} N"
            yield error("sign", "thrust", f"be {word} at {volts:+.4g} {thruster.input_unit}", got)
            return
    if gain > 0 and not 1 / _FACTOR < gain * full / forward < _FACTOR:
        unit = thruster.input_unit
        got = f"{gain:.4g} N/{unit} where {full:.4g} {unit} give {forward:.4g} N"
        should = "be about the thrust per volt: it is the gain of the model that the controller inverts"
        yield advice("gain", "voltage_gain", should, got)
    for sentence in thruster.advice():
        yield Finding("advice", "motor", "thruster", sentence.rstrip("."))
    if not gain > 0:
        yield error("gain", "voltage_gain", "be positive", f"{gain:.4g} N/V")
    at_rest = np.asarray(thruster.thrust(thruster.initial_state(1), jnp.zeros(1)))
    if np.any(at_rest):
        yield error("rest", "thrust", "be zero at rest without voltage", f"{at_rest.ravel()[0]:.4g} N")


def _full_voltage(thruster: AbstractThruster) -> float:
    """Full voltage, V, or full command in another unit; a moderate one where there is no limit."""
    supply = float(np.min(thruster.supply))
    return supply if np.isfinite(supply) else _VOLTAGE


def _settled_thrust(thruster: AbstractThruster, voltage: float) -> tuple[float, float]:
    """Steady thrust, N, of a voltage within the limits, and of its opposite; the mean of thrusters that differ."""
    count = thruster.count() or 1
    volts = [jnp.clip(jnp.full(count, side * voltage), *thruster.limits()) for side in (1, -1)]
    states = [thruster.initial_state(count) for _ in volts]
    flat, tree = ravel_pytree(states)
    if flat.size:
        rates = lambda x: [thruster.dynamics(state, volt) for state, volt in zip(tree(x), volts, strict=True)]
        rate = jax.jit(lambda x: ravel_pytree(rates(x))[0])
        rates_at = lambda t, x: np.asarray(rate(x))
        settled = scipy.integrate.solve_ivp(rates_at, (0, _LONG), np.asarray(flat), method="LSODA")
        states = tree(jnp.asarray(settled.y[:, -1]))
    forward, reverse = (float(np.mean(thruster.thrust(state, volt))) for state, volt in zip(states, volts, strict=True))
    return forward, reverse


def derived_of_thruster(thruster: AbstractThruster) -> tuple[tuple[str, str, str], ...]:
    """Rows (what, value, unit)."""
    supply = float(thruster.supply)
    limit = _full_voltage(thruster)
    unit = thruster.input_unit
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
        rows.append((f"steady thrust at +-{limit:g} {unit}", _row(_settled_thrust(thruster, limit)), "N"))
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
