"""Modes of the computer that runs the controller."""

import equinox as eqx
import jax
import jax.numpy as jnp

from undertow.core.numerics.number import Number
from undertow.physics.faults.memory_faults import flipped, with_entry
from undertow.physics.faults.mode import (
    NO_SEVERITY,
    AbstractComputationFault,
    Execution,
    Instant,
    Severity,
    execution_mode,
)

# Multiples of the golden section, modulo one, fill (0, 1) evenly: H. Weyl, Math. Ann. 77 (1916).
_GOLDEN = 0.6180339887498949


@execution_mode(default_duration=1.0)
def hang(instant: Instant, dt: Number) -> Execution:
    """The computer hangs for a second, unless a duration is given, and then continues as if nothing had happened."""
    return Execution(jnp.asarray(False), dt)


@execution_mode(Severity("control steps from one that is dropped to the next", "", 5.0, 1.0, 1e6))
def dropped_step(instant: Instant, dt: Number) -> Execution:
    """Control steps that are left out, of which the controller does not know."""
    return Execution(instant.number % jnp.round(instant.severity).astype(int) != 0, dt)


@execution_mode(Severity("control steps from one that is duplicated to the next", "", 5.0, 1.0, 1e6))
def duplicated_step(instant: Instant, dt: Number) -> Execution:
    """Control steps in which the controller is computed twice, as where a message arrives twice."""
    again = instant.number % jnp.round(instant.severity).astype(int) == 0
    return Execution(jnp.asarray(True), dt, again)


@execution_mode(Severity("sampling times that a computation takes beyond one", "", 2.0, 1.0, 1e6))
def overrun(instant: Instant, dt: Number) -> Execution:
    """The controller is computed in one of several control steps only, and measures the time since the last."""
    length = 1 + jnp.round(instant.severity)
    return Execution(instant.number % length.astype(int) == 0, dt * length)


@execution_mode(Severity("largest error as a share of the sampling time", "", 0.8, 0.0, 100.0))
def jitter(instant: Instant, dt: Number) -> Execution:
    """Errors of the measured sampling time, other ones in every step."""
    multiple = _GOLDEN * jnp.asarray(instant.number, dtype=float)
    return Execution(jnp.asarray(True), dt * (1 + instant.severity * (2 * (multiple - jnp.floor(multiple)) - 1)))


@execution_mode(
    Severity(
        "sampling time that the controller is given once; negative where the clock goes back", "s", -1.0, -1e9, 1e9
    )
)
def clock_jump(instant: Instant, dt: Number) -> Execution:
    """A jump of the clock: the controller is given a wrong sampling time once."""
    return Execution(jnp.asarray(True), jnp.where(instant.number == 0, instant.severity, dt))


class Reload(AbstractComputationFault):
    """The state of the law begins anew from the measurement of the onset."""

    severity = NO_SEVERITY

    def execution(self, instant, dt):
        return Execution(jnp.asarray(True), dt)

    def state(self, instant, law, z, y, r):
        first, fresh = instant.active & (instant.number == 0), law.init(y, r)
        return jax.tree.map(lambda new, old: jnp.where(first, new, old), fresh, z)


def reload() -> Reload:
    """The controller is restarted in the middle of a run."""
    return Reload()


class BitFlip(AbstractComputationFault):
    """One bit of a number flips once, at the onset. A number of zero may stay the same."""

    entry: int | None = eqx.field(static=True)  # from 1; None for the numbers of the largest magnitude

    severity = Severity("bit, from 0 for the sign; 1 is the largest of the exponent", "", 8.0, 0.0, 31.0)

    def execution(self, instant, dt):
        return Execution(jnp.asarray(True), dt)

    def state(self, instant, law, z, y, r):
        first = instant.active & (instant.number == 0)
        return with_entry(z, self.entry, first, lambda number: flipped(number, instant.severity))


def bit_flip(entry: int | None = None) -> BitFlip:
    """A bit flips in the memory of the controller.

    Args:
        entry: which number of the state, from 1; by default that of the largest magnitude.
    """
    return BitFlip(entry)


class NanState(AbstractComputationFault):
    """One number becomes NaN once, at the onset."""

    entry: int | None = eqx.field(static=True)  # from 1; None for the numbers of the largest magnitude

    severity = NO_SEVERITY

    def execution(self, instant, dt):
        return Execution(jnp.asarray(True), dt)

    def state(self, instant, law, z, y, r):
        first = instant.active & (instant.number == 0)
        return with_entry(z, self.entry, first, lambda number: jnp.full_like(number, jnp.nan))


def nan_state(entry: int | None = None) -> NanState:
    """A number in the memory of the controller is not a number any more.

    Args:
        entry: which number of the state, from 1; by default that of the largest magnitude.
    """
    return NanState(entry)


PARTS = (hang, dropped_step, duplicated_step, overrun, jitter, clock_jump, reload, bit_flip, nan_state)
