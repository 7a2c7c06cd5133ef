"""Does a thruster keep its contract, and does it push the way it says?"""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from scipy.integrate import solve_ivp

from undertow.analysis.answers import alike, is_a, shaped
from undertow.analysis.finding import Finding, advice, error
from undertow.thrusters.thruster import AbstractThruster, Powers, PropellerReport

_COUNT = 3  # thrusters at once: no other size that a part may happen to have
_VOLTAGE = 10.0  # V, where a thruster has no limit
_LONG = 60.0  # s, by when every thruster has settled
_FACTOR = 3.0  # between the gain the model takes and that at full voltage


def check_thruster(thruster: AbstractThruster) -> Iterator[Finding]:
    """Every method once, for three thrusters at different voltages."""
    volts = full_voltage(thruster) * jnp.array([0.4, -0.7, 1.0])
    state = thruster.initial_state(_COUNT)
    jax.eval_shape(thruster.dynamics, state, volts)  # whether it compiles
    jax.eval_shape(thruster.thrust, state, volts)
    each, once = (_COUNT,), ()
    powers, report = thruster.powers(state, volts), thruster.report(state)
    wrong = [
        *alike("dynamics", thruster.dynamics(state, volts), state, "have the form of the state"),
        *shaped("thrust", thruster.thrust(state, volts), each),
        *shaped("current", thruster.current(state, volts), each),
        *shaped("stored", thruster.stored(state), each, once),
        *shaped("voltage_gain", thruster.voltage_gain(), once, each),
        *is_a("advice", thruster.advice(), tuple),
        *(is_a("powers", powers, Powers) if powers is not None else ()),
        *(is_a("report", report, PropellerReport) if report is not None else ()),
    ]
    for name, values in (("powers", powers), ("report", report)):
        if isinstance(values, Powers | PropellerReport):
            wrong += [finding for value in values for finding in shaped(name, value, each)]
    if wrong:
        yield from wrong
        return
    yield from _ways(thruster)


def full_voltage(thruster: AbstractThruster) -> float:
    """Full voltage, V; a moderate one where there is no limit."""
    supply = float(np.min(thruster.supply))
    return supply if np.isfinite(supply) else _VOLTAGE


def settled_thrust(thruster: AbstractThruster, voltage: float) -> float:
    """Thrust, N, long after a voltage was applied to a thruster at rest."""
    volts = jnp.full(1, voltage)
    start = thruster.initial_state(1)
    flat, tree = ravel_pytree(start)
    if not flat.size:
        return float(thruster.thrust(start, volts)[0])
    rate = jax.jit(lambda x: ravel_pytree(thruster.dynamics(tree(x), volts))[0])
    end = solve_ivp(lambda t, x: np.asarray(rate(x)), (0, _LONG), np.asarray(flat), method="LSODA").y[:, -1]
    return float(thruster.thrust(tree(jnp.asarray(end)), volts)[0])


def _ways(thruster: AbstractThruster) -> Iterator[Finding]:
    """Positive voltage pushes forward, and about as much as the controller's model is told."""
    full, gain = full_voltage(thruster), float(np.min(thruster.voltage_gain()))
    for sign, word in ((1, "positive"), (-1, "negative")):
        thrust = settled_thrust(thruster, sign * full)
        if not sign * thrust > 0:
            yield error("sign", "thrust", f"be {word} at {sign * full:+.4g} V", f"{thrust:.4g} N")
            return
    ratio = gain * full / settled_thrust(thruster, full)
    if gain > 0 and not 1 / _FACTOR < ratio < _FACTOR:
        got = f"{gain:.4g} N/V where {full:.4g} V give {gain * full / ratio:.4g} N"
        should = "be about the thrust per volt: it is the gain of the model that the controller inverts"
        yield advice("gain", "voltage_gain", should, got)
