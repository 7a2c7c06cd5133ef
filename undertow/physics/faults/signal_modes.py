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
from undertow.physics.faults.mode import INPUTS, LARGE, NO_SEVERITY, READINGS, TARGET, AbstractMode, Altered, Severity

_MOST = 512  # control steps that are remembered


class Bias(AbstractMode):
    """An offset of every entry."""

    targets = (*READINGS, "thruster")
    severity = Severity("offset", TARGET, 1.0, -LARGE, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(value + moment.severity, jnp.asarray(True)), memory


def bias() -> Bias:
    """Offset of the signal."""
    return Bias()


class Scale(AbstractMode):
    """A factor on every entry."""

    targets = (*READINGS, "thruster")
    severity = Severity("factor", "", 1.5, -100.0, 100.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(moment.severity * value, jnp.asarray(True)), memory


def scale() -> Scale:
    """Factor on the signal, such as a wrong calibration, or half of the voltage of a thruster."""
    return Scale()


class Noise(AbstractMode):
    """Normally distributed noise, independent from one control step to the next."""

    targets = (*READINGS, *INPUTS)
    severity = Severity("standard deviation", TARGET, 0.3, 0.0, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(
            value + moment.severity * jax.random.normal(numbered(moment.key, moment.step), value.shape, value.dtype),
            jnp.asarray(True),
        ), memory


def noise() -> Noise:
    """White noise on the signal; on the bus a ripple, which differs between the inputs."""
    return Noise()


class Quantised(AbstractMode):
    """Rounded to multiples of a step."""

    targets = (*READINGS, "thruster")
    severity = Severity("step", TARGET, 0.5, 1e-9, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(moment.severity * jnp.round(value / moment.severity), jnp.asarray(True)), memory


def quantised() -> Quantised:
    """Rounded to multiples of the severity."""
    return Quantised()


class Off(AbstractMode):
    """Zero; the readings of a sensor do not arrive."""

    targets = (*READINGS, *INPUTS)
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.zeros_like(value), jnp.asarray(False)), memory


def off() -> Off:
    """Nothing: a quantity reads zero, a sensor delivers no readings, a thruster gets zero, the bus is dead."""
    return Off()


class Nan(AbstractMode):
    """Not a number (NaN) in every entry."""

    targets = READINGS
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(jnp.full_like(value, jnp.nan), jnp.asarray(True)), memory


def nan() -> Nan:
    """Readings that are not a number."""
    return Nan()


class Stuck(AbstractMode):
    """The value of the onset, bit for bit; a sensor goes on to deliver it."""

    targets = (*READINGS, "thruster")
    severity = NO_SEVERITY
    delays = False

    def init(self, value):
        return value

    def apply(self, memory, moment, value):
        held = jnp.where(moment.active, memory, value)
        return Altered(held, jnp.asarray(True)), held


def stuck() -> Stuck:
    """Frozen at the last value before the onset."""
    return Stuck()


class Garbage(AbstractMode):
    """Normally distributed random numbers, new at every control step, whatever the signal is."""

    targets = (*READINGS, "thruster")
    severity = Severity("standard deviation", TARGET, 2.0, 0.0, LARGE)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(
            moment.severity * jax.random.normal(numbered(moment.key, moment.step), value.shape, value.dtype),
            jnp.asarray(True),
        ), memory


def garbage() -> Garbage:
    """Random numbers in place of the signal."""
    return Garbage()


class Glitch(AbstractMode):
    """An offset for one control step, at the onset and at regular intervals after it."""

    period: Float[Param, ""] = param("s", "between two glitches")
    targets = (*READINGS, *INPUTS)
    severity = Severity("offset", TARGET, 5.0, -LARGE, LARGE)
    delays = False

    def __check_init__(self):
        checks.positive("period", self.period, "s")

    def init(self, value):
        return jnp.asarray(-1, dtype=int)

    def apply(self, memory, moment, value):
        number = jnp.where(moment.active, jnp.floor(moment.since / self.period + 1e-6), -1.0).astype(int)
        return Altered(jnp.where(number > memory, value + moment.severity, value), jnp.asarray(True)), number


def glitch(period: float = 1.0) -> Glitch:
    """Single outliers.

    Args:
        period: between two of them, s.
    """
    return Glitch(period)


class Intermittent(AbstractMode):
    """Lost for random periods of equal length: a reading keeps its last value, an input is zero."""

    period: Float[Param, ""] = param("s", "length of each period, which is lost as a whole or not")
    targets = (*READINGS, *INPUTS)
    severity = Severity("probability that a period is lost", "", 0.5, 0.0, 1.0)
    delays = False

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
    delays = False

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
