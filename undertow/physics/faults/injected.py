"""Faults of one closed loop, injected into measurement, input and load."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from undertow.core.contracts import AbstractFaults, Inputs, Load, Measurement, ModelScaling, Pose
from undertow.core.param import Param, param
from undertow.physics.disturbances.loads import with_scaling
from undertow.physics.faults.mode import (
    AbstractMode,
    AbstractPlantFault,
    AbstractThrustMode,
    Moment,
    Presence,
    apply_mode,
)
from undertow.physics.faults.occurrence import Occurrence, Timing
from undertow.physics.faults.quantities import quantities_of

# Inputs whose limit is larger have none: severities are then in the unit of the input.
_UNLIMITED = 1e5


class QuantityFault(eqx.Module):
    """A fault of a quantity that the controller receives."""

    mode: AbstractMode
    occurrence: Occurrence
    quantity: str = eqx.field(static=True)
    chosen: Float[Param, " width"] = param("", "1 for entries that are affected, else 0")


class InputFault(eqx.Module):
    """A fault of the input, or of the thrust, of some thrusters."""

    mode: AbstractMode | AbstractThrustMode
    occurrence: Occurrence
    announced: bool = eqx.field(static=True)
    chosen: Float[Param, " m"] = param("", "1 for thrusters that are affected, else 0")
    sampled: int | None = eqx.field(static=True, default=None)  # place among faults of a thruster that is sampled


class PlantFault(eqx.Module):
    """A fault of the plant or its surroundings."""

    fault: AbstractPlantFault
    occurrence: Occurrence


class Realized(NamedTuple):
    """A fault in one run."""

    timing: Timing
    chosen: Float[Array, " width"]
    key: PRNGKeyArray


class FaultsState(NamedTuple):
    """Memory of the faults."""

    step: Int[Array, ""]  # number of the next control step
    time: Float[Array, ""]  # of the last one, s
    measurement: tuple[Any, ...]
    input: tuple[Any, ...]


class Faults(AbstractFaults):
    """Faults in the order in which they act; those of sensors and of the computer act elsewhere and are counted here.

    A thruster that is sampled is another one for each of the faults that ask for one.
    """

    of_measurement: tuple[QuantityFault, ...]
    of_input: tuple[InputFault, ...]
    of_plant: tuple[PlantFault, ...]
    elsewhere: tuple[Occurrence, ...]
    inputs: int = eqx.field(static=True)
    entries: tuple[int, ...] = eqx.field(
        static=True
    )  # of measurement, of input, of plant: their places in the scenario

    def realize(self, key):
        own, which = jax.random.split(key)
        every = (*self.of_measurement, *self.of_input, *self.of_plant)
        keys = jax.random.split(own, max(1, len(every)))
        chance = jax.random.uniform(which, (self.inputs,), jnp.result_type(float))
        rank = (chance[:, None] > chance[None, :]).sum(1)
        found = []
        for fault, each in zip(every, keys, strict=False):
            if isinstance(fault, PlantFault):
                chosen = jnp.ones(1)
            elif isinstance(fault, InputFault) and fault.sampled is not None:
                chosen = (rank == fault.sampled % self.inputs).astype(fault.chosen.dtype)
            else:
                chosen = fault.chosen
            times, steps = jax.random.split(each)
            found.append(Realized(fault.occurrence.realize(times), chosen, steps))
        first, second = len(self.of_measurement), len(self.of_measurement) + len(self.of_input)
        return tuple(found[:first]), tuple(found[first:second]), tuple(found[second:])

    def sampled(self, realization):
        """Onset, severity and affected thrusters."""
        realized = [fault for group in realization for fault in group]
        return {
            entry: {"onset": fault.timing.onset, "severity": fault.timing.severity, "affected": fault.chosen}
            for entry, fault in zip(self.entries, realized, strict=True)
        }

    def init(self, realization, y: Measurement, u: Inputs) -> FaultsState:
        known = quantities_of(y)
        read = tuple(one.mode.init(known[one.quantity].read(y)) for one in self.of_measurement)
        driven = tuple(one.mode.init(u) if isinstance(one.mode, AbstractMode) else () for one in self.of_input)
        return FaultsState(jnp.zeros((), dtype=int), jnp.zeros(()), read, driven)

    def measurement(self, realization, state: FaultsState, t, y: Measurement):
        known, after = quantities_of(y), []
        for fault, own, memory in zip(self.of_measurement, realization[0], state.measurement, strict=True):
            quantity = known[fault.quantity]
            value = quantity.read(y)
            moment = _moment(own, state, t, jnp.full(value.shape, quantity.turn), holds=True)
            altered, memory = apply_mode(fault.mode, memory, moment, value)
            faulty = quantity.replaced(y, jnp.where(own.chosen > 0, altered.value, value))
            # What the fault leaves alone keeps its bits, which replacing it might round.
            y = jax.tree.map(lambda new, old, moment=moment: jnp.where(moment.active, new, old), faulty, y)
            after.append(memory)
        if self.of_input:
            y = y._replace(health=self._health(realization, t))
        return y, state._replace(measurement=tuple(after))

    def _health(self, realization, t) -> Float[Array, " m"]:
        health = jnp.ones(self.inputs)
        for fault, own in zip(self.of_input, realization[1], strict=True):
            if fault.announced:
                health = jnp.where(own.timing.active(t) & (own.chosen > 0), 0.0, health)
        return health

    def input(self, realization, state: FaultsState, t, u: Inputs, limits: tuple[Inputs, Inputs]):
        low, high = limits
        scale = jnp.where((high > 0) & (high < _UNLIMITED), high, 1.0)
        after = []
        for fault, own, memory in zip(self.of_input, realization[1], state.input, strict=True):
            if isinstance(fault.mode, AbstractMode):
                moment = _moment(own, state, t, jnp.zeros_like(u), holds=False)
                altered, memory = apply_mode(fault.mode, memory, moment, u / scale)
                acting = jnp.clip(scale * altered.value, low, high)
                u = jnp.where(moment.active & (own.chosen > 0), acting, u)
            after.append(memory)
        return u, FaultsState(state.step + 1, t, state.measurement, tuple(after))

    def load(self, realization, t, pose: Pose | None, load: Load) -> Load:
        for fault, own in zip(self.of_input, realization[1], strict=True):
            if isinstance(fault.mode, AbstractThrustMode):
                one, present = jnp.ones(()), own.timing.active(t) & (own.chosen > 0)
                thrust = jnp.where(present, fault.mode.factor(own.timing.severity), 1.0)
                load = with_scaling(load, pose, ModelScaling(one, one, one, thrust))
        for one, own in zip(self.of_plant, realization[2], strict=True):
            timing = own.timing
            load = one.fault.load(Presence(timing.active(t), t - timing.onset, timing.severity), pose, load)
        return load

    def active(self, realization, t):
        timings = [own.timing for group in realization for own in group]
        timings += [occurrence.fixed() for occurrence in self.elsewhere]
        return sum((jnp.where(timing.active(t), 1, 0) for timing in timings), jnp.zeros((), dtype=int))

    def jumps(self, duration: float) -> tuple[float, ...]:
        parts = (*self.of_measurement, *self.of_input, *self.of_plant)
        occurrences = (*(one.occurrence for one in parts), *self.elsewhere)
        return tuple(sorted({time for one in occurrences for time in one.jumps(duration)}))


def _moment(own: Realized, state: FaultsState, t, turn, holds: bool) -> Moment:
    timing = own.timing
    return Moment(timing.active(t), t - timing.onset, t - state.time, timing.severity, own.key, state.step, turn, holds)
