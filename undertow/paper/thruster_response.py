"""Fig. 2: response of the paper's motor to a slow and a fast voltage, and errors of static thruster models."""

import functools
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.numerics.integrators import rk4
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.thrusters.thruster import AbstractThruster

AMPLITUDE = 10.0  # V
LONG, SHORT = 1.0, 10.0  # rad/s: V = 10 sin t and V = 10 sin 10 t

_STEPS = 2000  # integration steps per period
_KEEP = 5  # every fifth step is kept
_PERIODS = 8  # the last one is kept; the slowest motor lag is 0.14 s

Series = Float[np.ndarray, " samples"]


class Period(NamedTuple):
    """One period of the motor after its transient has decayed."""

    frequency: float  # rad/s
    time: Series  # s, from the start of the period
    voltage: Series  # V
    thrust: Series  # N
    current: Series  # A


class MemorylessFit(NamedTuple):
    """A memoryless law, fitted to the long period by least squares."""

    text: str  # as the paper writes it
    coefficient: float
    unit: str
    error_long: float  # rms error in % of the rms of the modelled signal
    error_short: float


class ThrusterResponse(NamedTuple):
    """Fig. 2 in numbers; the laws' errors are the evidence for claim C11."""

    long: Period
    short: Period
    laws: tuple[MemorylessFit, MemorylessFit, MemorylessFit]


@functools.cache  # used by a figure and a claim
def thruster_response() -> ThrusterResponse:
    """Drive the motor of Table 3, unmodelled Delta_o left out, with the two voltages of Fig. 2; fit the static laws.

    Eqs. (8)-(11).
    """
    thruster = paper_table3("electromechanical")
    long, short = (_steady_period(thruster, frequency) for frequency in (LONG, SHORT))
    laws = (
        _law("T = c_0 V", "N/V", lambda p: (p.voltage, p.thrust), long, short),
        _law("T = c_V V|V|", "N/V^2", lambda p: (p.voltage * np.abs(p.voltage), p.thrust), long, short),
        _law("I = c_I T", "A/N", lambda p: (p.thrust, p.current), long, short),
    )
    return ThrusterResponse(long, short, laws)


def _steady_period(thruster: AbstractThruster, frequency: float) -> Period:
    time, *signals = (np.asarray(series) for series in _actuators(thruster, jnp.asarray(frequency)))
    last = slice(-_STEPS, None, _KEEP)
    return Period(frequency, time[last] - time[-_STEPS], *(series[last] for series in signals))


@eqx.filter_jit
def _actuators(thruster: AbstractThruster, frequency: Float[Array, ""]):
    """Time, voltage, thrust and current over all periods, from rest."""
    dt = 2 * jnp.pi / frequency / _STEPS
    voltage = lambda t: AMPLITUDE * jnp.sin(frequency * t)[None]
    field = lambda t, state: thruster.dynamics(state, voltage(t))

    def step(state, t):
        volts = voltage(t)
        sample = (t, volts[0], thruster.thrust(state, volts)[0], thruster.current(state, volts)[0])
        return rk4(field, t, state, dt), sample

    times = dt * jnp.arange(_PERIODS * _STEPS, dtype=dt.dtype)
    return jax.lax.scan(step, thruster.initial_state(1), times)[1]


def _law(text: str, unit: str, pick, long: Period, short: Period) -> MemorylessFit:
    """Least squares through the origin on the long period: output = coefficient * input."""
    inputs, measured = pick(long)
    coefficient = float(inputs @ measured / (inputs @ inputs))

    def error(period: Period) -> float:
        inputs, measured = pick(period)
        return float(100 * np.sqrt(np.mean((measured - coefficient * inputs) ** 2) / np.mean(measured**2)))

    return MemorylessFit(text, coefficient, unit, error(long), error(short))
