"""Instruments and a plain observer, which gives the controller x and x_dot at the controller's own rate."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.core.contracts import AbstractSensor, Measurement
from undertow.core.errors import BadInput
from undertow.sensors.estimate import Estimate, estimate_of, motion_of
from undertow.sensors.imu import IMU
from undertow.sensors.sensor import AbstractInstrument
from undertow.sensors.propeller_speed import PropellerSpeed
from undertow.sensors.sampling import Spoken
from undertow.numerics.randomness import numbered

# (m/s)^2 s; less counts as none.
_NOISELESS = 1e-20


class NavigationState(NamedTuple):
    """What it remembers."""

    time: Float[Array, ""]  # of the last tick, s
    velocity: Float[Array, "3"]  # the true one then, m/s: accelerometers feel its change
    spoken: tuple[Spoken, ...]  # one per instrument
    estimate: Estimate
    ignored: Int[Array, ""]  # readings so far that were no numbers


class Navigation(AbstractSensor):
    """Strapdown inertial navigation, corrected by whatever else arrives, each by its own constant share.

    Between readings the estimate moves on by rates and acceleration of the IMU. A late reading is compared with what
    the estimate was when it was taken. There is no Kalman filter and no estimate of a bias: an offset of the
    accelerometers, or of roll or pitch (times gravity), shows in the velocity, as large as it grows to until the next
    reading of the DVL over the share that is given to it. A reading that is no number counts as lost.

    Raises:
        BadInput: no instrument, or no IMU.
    """

    instruments: tuple[AbstractInstrument, ...]
    smooth: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        for i, instrument in enumerate(self.instruments):
            if not isinstance(instrument, AbstractInstrument):
                raise BadInput(f"instruments[{i}]", "be an instrument", type(instrument).__name__)
        if not any(isinstance(instrument, IMU) for instrument in self.instruments):
            hint = "Add `imu`: nothing else tells roll, pitch and angular rates"
            raise BadInput("instruments", "have an IMU among them", f"{len(self.instruments)} without", hint=hint)

    def draw(self, key):
        return jax.random.split(key, len(self.instruments))

    def velocity_noise(self, dt):
        """That of all readings of a second, as if they came evenly at every tick; the filters' memory is left out."""
        told = [one.velocity_noise() ** 2 * one.sampling.period for one in self.instruments]
        density = 1 / sum(1 / jnp.maximum(each, _NOISELESS) for each in told)
        return jnp.where(jnp.isfinite(density) & (density > 2 * _NOISELESS), jnp.sqrt(density / dt), 0.0)

    def init(self, path, truth: Measurement) -> NavigationState:
        if truth.position.shape != (6,):
            hint = "Take `perfect` or `white_noise`"
            raise BadInput("", "be used on a vehicle", f"a plant of {truth.position.shape[0]} outputs", hint=hint)
        motion = motion_of(truth, truth.velocity[:3], jnp.zeros(()))
        readings = [instrument.reading(motion) for instrument in self.instruments]
        chances = _chances(path, jnp.full(len(readings), -1), readings)
        spoken = tuple(
            instrument.sampling.init(reading, chance[:-1])
            for instrument, reading, chance in zip(self.instruments, readings, chances, strict=True)
        )
        estimate = estimate_of(truth)
        if not any(isinstance(instrument, PropellerSpeed) for instrument in self.instruments):
            estimate = estimate._replace(actuator=None)
        return NavigationState(jnp.zeros(()), motion.velocity, spoken, estimate, jnp.zeros((), dtype=int))

    def measure(self, path, state: NavigationState, t, truth: Measurement):
        elapsed = t - state.time
        motion = motion_of(truth, state.velocity, elapsed)
        readings = [instrument.reading(motion) for instrument in self.instruments]
        numbers = jnp.stack([instrument.sampling.number(t) for instrument in self.instruments])
        heard = [
            instrument.sampling.hear(spoken, t, reading, chance)
            for instrument, spoken, reading, chance in zip(
                self.instruments, state.spoken, readings, _chances(path, numbers, readings), strict=True
            )
        ]
        arrivals = [arrival for arrival, _ in heard]
        finite = [jnp.isfinite(reading).all() for reading, _ in arrivals]
        ignored = state.ignored + sum(
            jnp.where(fresh & ~good, 1, 0) for (_, fresh), good in zip(arrivals, finite, strict=True)
        )
        news = [
            (instrument, (reading, fresh & good))
            for instrument, (reading, fresh), good in zip(self.instruments, arrivals, finite, strict=True)
        ]
        estimate = state.estimate
        for instrument, (reading, fresh) in news:
            estimate = _either(fresh, instrument.foretell(estimate, reading), estimate)
        estimate = estimate.predicted(elapsed)
        for instrument, (reading, fresh) in news:
            estimate = _either(fresh, instrument.correct(estimate, reading), estimate)
        spoken = tuple(spoken for _, spoken in heard)
        return estimate.measurement(), NavigationState(t, motion.velocity, spoken, estimate, ignored)

    def ignored(self, state: NavigationState):
        return state.ignored


def _chances(keys, numbers, readings) -> list:
    """Standard normal numbers, one per entry of each reading and one more; drawn together, which compiles faster."""
    most = max(reading.size for reading in readings) + 1
    draw = lambda key, number: jax.random.normal(numbered(key, number), (most,), dtype=readings[0].dtype)
    together = jax.vmap(draw)(keys, numbers)
    return [row[: reading.size + 1] for row, reading in zip(together, readings, strict=True)]


def _either(fresh, new: Estimate, old: Estimate) -> Estimate:
    return jax.tree.map(lambda a, b: jnp.where(fresh, a, b), new, old)


def navigation(instruments) -> Navigation:
    """A vehicle that knows where it is from its instruments only. For the sampled loop.

    Args:
        instruments: any of imu, dvl, depth, position_fix, compass, propeller_speed; an IMU must be among them.
    """
    return Navigation(instruments=tuple(instruments))
