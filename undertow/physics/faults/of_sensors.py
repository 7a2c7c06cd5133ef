"""Faults of the sensors of a navigation filter: of their readings, before the filter gets them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.core.param import Param, param
from undertow.physics.faults.mode import AbstractMode, Moment, apply_mode
from undertow.physics.faults.occurrence import Occurrence
from undertow.physics.sensors.received import AbstractSensorFaults, Received


class SensorFault(eqx.Module):
    """A fault of one sensor, at the same time in every run."""

    mode: AbstractMode
    occurrence: Occurrence
    sensor: int = eqx.field(static=True)  # its place among the sensors of the filter
    chosen: Float[Param, "..."] = param("", "1 for entries of the reading that are affected, else 0")
    turn: Float[Param, "..."] = param("", "after how much an entry repeats; 0 where it does not")


class SensorFaultsState(NamedTuple):
    """Memory of the faults."""

    step: Int[Array, ""]  # number of the next control step
    time: Float[Array, ""]  # of the last one, s
    memories: tuple[Any, ...]


class SensorFaults(AbstractSensorFaults):
    """Faults of sensors, in the order in which they act. The filter does not learn of them.

    A sensor goes on to deliver: a fault changes what, and whether. A delay moves readings with the news that they are
    new.
    """

    members: tuple[SensorFault, ...]

    def init(self, readings):
        memories = tuple(one.mode.init(_signal(one.mode, readings[one.sensor], False)) for one in self.members)
        return SensorFaultsState(jnp.zeros((), dtype=int), jnp.zeros(()), memories)

    def received(self, key, state: SensorFaultsState, t, received):
        found, after = list(received), []
        keys = jax.random.split(key, max(1, len(self.members)))
        for fault, own, memory in zip(self.members, keys, state.memories, strict=True):
            before, timing = found[fault.sensor], fault.occurrence.fixed()
            signal = _signal(fault.mode, before.reading, before.fresh)
            turn = jnp.concatenate([fault.turn, jnp.zeros(len(signal) - len(fault.turn))])
            active, since, elapsed = timing.active(t), t - timing.onset, t - state.time
            moment = Moment(active, since, elapsed, timing.severity, own, state.step, turn, holds=True)
            altered, memory = apply_mode(fault.mode, memory, moment, signal)
            width = len(before.reading)
            fresh = altered.value[width] > 0 if fault.mode.delays else before.fresh
            fresh = jnp.where(active, fresh & altered.present, before.fresh)
            reading = jnp.where(active & (fault.chosen > 0), altered.value[:width], before.reading)
            found[fault.sensor] = Received(reading, fresh, before.age)
            after.append(memory)
        return tuple(found), SensorFaultsState(state.step + 1, jnp.asarray(t), tuple(after))


def _signal(mode: AbstractMode, reading, fresh):
    """The reading; with the news that it is new as a further entry for a mode that delays."""
    if not mode.delays:
        return reading
    return jnp.concatenate([reading, jnp.where(fresh, 1.0, 0.0)[None]])
