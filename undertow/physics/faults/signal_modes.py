"""Modes of signals: of quantities that a controller receives, of readings of sensors, of inputs of the plant."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.numerics.random_keys import numbered
from undertow.core.param import Param, param
from undertow.physics.faults.mode import (
    INPUTS,
    LARGE,
    NO_SEVERITY,
    READINGS,
    TARGET,
    AbstractMode,
    Altered,
    Moment,
    Severity,
    Signal,
    signal_mode,
)

_MOST = 512  # control steps that are remembered


@signal_mode((*READINGS, "thruster"), Severity("offset", TARGET, 1.0, -LARGE, LARGE))
def bias(moment: Moment, value: Signal) -> Signal:
    """Offset of the signal."""
    return value + moment.severity


@signal_mode((*READINGS, "thruster"), Severity("factor", "", 1.5, -100.0, 100.0))
def scale(moment: Moment, value: Signal) -> Signal:
    """Factor on the signal, such as a wrong calibration, or half of the voltage of a thruster."""
    return moment.severity * value


@signal_mode((*READINGS, *INPUTS), Severity("standard deviation", TARGET, 0.3, 0.0, LARGE))
def noise(moment: Moment, value: Signal) -> Signal:
    """White noise on the signal; on the bus a ripple, which differs between the inputs."""
    return value + moment.severity * _normal(moment, value)


@signal_mode((*READINGS, "thruster"), Severity("standard deviation", TARGET, 2.0, 0.0, LARGE))
def garbage(moment: Moment, value: Signal) -> Signal:
    """Random numbers in place of the signal."""
    return moment.severity * _normal(moment, value)


def _normal(moment: Moment, value: Signal) -> Signal:
    """Normally distributed numbers, independent from one control step to the next."""
    return jax.random.normal(numbered(moment.key, moment.step), value.shape, value.dtype)


@signal_mode((*READINGS, "thruster"), Severity("step", TARGET, 0.5, 1e-9, LARGE))
def quantised(moment: Moment, value: Signal) -> Signal:
    """Rounded to multiples of the severity."""
    return moment.severity * jnp.round(value / moment.severity)


@signal_mode((*READINGS, *INPUTS), arrives=False)
def off(moment: Moment, value: Signal) -> Signal:
    """Nothing: a quantity reads zero, a sensor delivers no readings, a thruster gets zero, the bus is dead."""
    return jnp.zeros_like(value)


@signal_mode(READINGS)
def nan(moment: Moment, value: Signal) -> Signal:
    """Readings that are not a number."""
    return jnp.full_like(value, jnp.nan)


class FrozenSignal(AbstractMode):
    """The value of the onset, bit for bit; a sensor goes on to deliver it."""

    targets = (*READINGS, "thruster")
    severity = NO_SEVERITY

    def init(self, value):
        return value

    def apply(self, memory, moment, value):
        held = jnp.where(moment.active, memory, value)
        return Altered(held, jnp.asarray(True)), held


def stuck() -> FrozenSignal:
    """Frozen at the last value before the onset."""
    return FrozenSignal()


class PeriodicOutliers(AbstractMode):
    """An offset for one control step, at the onset and at regular intervals after it."""

    period: Float[Param, ""] = param("s", "between two glitches")
    targets = (*READINGS, *INPUTS)
    severity = Severity("offset", TARGET, 5.0, -LARGE, LARGE)

    def __check_init__(self):
        checks.positive("period", self.period, "s")

    def init(self, value):
        return jnp.asarray(-1, dtype=int)

    def apply(self, memory, moment, value):
        number = jnp.where(moment.active, jnp.floor(moment.since / self.period + 1e-6), -1.0).astype(int)
        return Altered(jnp.where(number > memory, value + moment.severity, value), jnp.asarray(True)), number


def glitch(period: float = 1.0) -> PeriodicOutliers:
    """Single outliers.

    Args:
        period: between two of them, s.
    """
    return PeriodicOutliers(period)


class Intermittent(AbstractMode):
    """Lost for random periods of equal length: a reading keeps its last value, an input is zero."""

    period: Float[Param, ""] = param("s", "length of each period, which is lost as a whole or not")
    targets = (*READINGS, *INPUTS)
    severity = Severity("probability that a period is lost", "", 0.5, 0.0, 1.0)

    def __check_init__(self):
        checks.positive("period", self.period, "s")

    def init(self, value):
        return value

    def apply(self, memory, moment, value):
        period = jnp.floor(moment.since / self.period + 1e-6).astype(int)
        chance = jax.random.uniform(numbered(moment.key, period), (), value.dtype)
        lost = moment.active & (chance < moment.severity)
        held = jnp.where(lost, memory, value)
        silent = held if moment.holds else jnp.where(lost, jnp.zeros_like(value), value)
        return Altered(silent, ~lost), held


def intermittent(period: float = 0.2) -> Intermittent:
    """Lost now and then, as by a loose contact.

    Args:
        period: length of each period, s, which is lost as a whole or not.
    """
    return Intermittent(period)


class Slow(AbstractMode):
    """First-order lag, dv/dt = (signal - v) / tau, by the implicit Euler method; angles go the shorter way round."""

    targets = (*READINGS, *INPUTS)
    severity = Severity("time constant", "s", 0.5, 0.0, 100.0)

    def init(self, value):
        return value

    def apply(self, memory, moment, value):
        span = jnp.maximum(moment.elapsed, 0.0)
        share = jnp.where(span > 0, span / jnp.where(span > 0, span + moment.severity, 1.0), 0.0)
        lagging = memory + share * moment.difference(value, memory)
        return Altered(lagging, jnp.asarray(True)), jnp.where(moment.active, lagging, value)


def slow() -> Slow:
    """First-order lag of the signal."""
    return Slow()


class Delayed(AbstractMode):
    """The signal of a whole number of control steps ago, the nearest to the severity; before t = 0 the first one.

    Raises:
        BadInput: sampling time not positive, or a delay of more than 512 control steps.
    """

    slots: int = eqx.field(static=True)  # control steps that are remembered
    sampling_time: Float[Param, ""] = param("s", "sampling time of the loop")
    targets = (*READINGS, "thruster")
    severity = Severity("delay", "s", 0.1, 0.0, 10.0)
    delays = True

    def __check_init__(self):
        checks.positive("sampling_time", self.sampling_time, "s")

    def init(self, value):
        return jnp.broadcast_to(value, (self.slots, *value.shape))

    def apply(self, memory, moment, value):
        newest = (jnp.arange(self.slots) == moment.step % self.slots)[:, None]
        memory = jnp.where(newest, value, memory)
        late = jnp.clip(jnp.round(moment.severity / self.sampling_time), 0, self.slots - 1).astype(int)
        return Altered(memory[(moment.step - late) % self.slots], jnp.asarray(True)), memory


def delayed(longest: float = 0.1, sampling_time: float = 1e-3) -> Delayed:
    """The signal as it was some time ago. A navigation filter takes a late reading for a new one.

    Args:
        longest: largest severity, s; a scenario sets it.
        sampling_time: that of the loop, s; a scenario sets it.

    Raises:
        BadInput: `longest` is negative, or more than 511 control steps.
    """
    checks.positive("sampling_time", sampling_time, "s")
    checks.not_negative("longest", longest, "s")
    steps = math.ceil(float(np.asarray(longest)) / float(np.asarray(sampling_time)) - 1e-6)
    if steps >= _MOST:
        limit = f"{(_MOST - 1) * sampling_time:g} s"
        raise BadInput("severity", f"be at most {_MOST - 1} control steps ({limit}) for a delay", f"{longest:g} s")
    return Delayed(steps + 1, sampling_time)


PARTS = (bias, scale, noise, quantised, off, nan, stuck, garbage, glitch, intermittent, slow, delayed)
