"""Faults of the computer: a wrapper around any controller."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from undertow.core.contracts import AbstractController, Inputs, Model
from undertow.physics.faults.mode import AbstractComputationFault, Instant
from undertow.physics.faults.occurrence import Occurrence


class ComputationFault(eqx.Module):
    """A fault of the computation, at the same time in every run."""

    fault: AbstractComputationFault
    occurrence: Occurrence


class ComputedState(NamedTuple):
    """State of the controller, and of the computer."""

    law: Any
    step: Int[Array, ""]  # number of the control step, from 0
    time: Float[Array, ""]  # of the step, s
    held: Inputs  # input that was applied last
    counts: tuple[Int[Array, ""], ...]  # control steps so far in which each fault was present


class FaultyComputer(AbstractController):
    """A controller on a computer that fails: it is computed late, twice, not at all, or its memory is altered.

    While it is not computed, the last input is held. The signals of such a step are those that the law would give.
    """

    model: Model
    law: AbstractController
    faults: tuple[ComputationFault, ...]

    def init(self, y, r):
        none = jnp.zeros((), dtype=int)
        law = self.law.init(y, r)
        command = jax.eval_shape(self.law.command, law, y, r)[0]
        held = jnp.zeros(command.shape, command.dtype)
        return ComputedState(law, none, jnp.zeros(()), held, tuple(none for _ in self.faults))

    def command(self, z: ComputedState, y, r):
        law, runs, _, _ = self._computed(z, y, r, jnp.zeros(()))
        command, signals = self.law.command(law, y, r)
        return jnp.where(runs, command, z.held), signals

    def advance(self, z: ComputedState, y, r, u_applied, dt):
        law, runs, own, twice = self._computed(z, y, r, dt)
        after = self.law.advance(law, y, r, u_applied, own)
        if twice is not None:
            again = self.law.advance(after, y, r, u_applied, own)
            after = _where(twice, again, after)
        step = z.step + 1
        counts = tuple(count + jnp.where(one.active, 1, 0) for count, one in zip(z.counts, self._now(z), strict=True))
        return ComputedState(_where(runs, after, law), step, step.astype(dt.dtype) * dt, u_applied, counts)

    def signals(self):
        return self.law.signals()

    def known_acceleration(self, z: ComputedState, y, u_applied):
        return self.law.known_acceleration(z.law, y, u_applied)

    @property
    def takes_raw_readings(self):
        return self.law.takes_raw_readings

    def _now(self, z: ComputedState) -> list[Instant]:
        timings = [one.occurrence.fixed() for one in self.faults]
        return [
            Instant(timing.active(z.time), count, timing.severity)
            for timing, count in zip(timings, z.counts, strict=True)
        ]

    def _computed(self, z: ComputedState, y, r, dt):
        """State of the law with which the step begins, whether it is computed, its dt, and whether twice."""
        law, runs, twice = z.law, jnp.asarray(True), None
        for one, now in zip(self.faults, self._now(z), strict=True):
            law = one.fault.state(now, self.law, law, y, r)
            found = one.fault.execution(now, dt)
            runs = runs & (found.runs | ~now.active)
            dt = jnp.where(now.active, found.dt, dt)
            if found.twice is not None:
                also = found.twice & now.active
                twice = also if twice is None else twice | also
        return law, runs, dt, twice


def computed(law: AbstractController, faults: tuple[ComputationFault, ...]) -> AbstractController:
    """The controller on a computer with these faults, which act in their order; itself without any."""
    if not faults:
        return law
    return FaultyComputer(law.model, law, faults)


def law_of_computed(controller: AbstractController) -> AbstractController:
    """The controller on a computer without faults."""
    return controller.law if isinstance(controller, FaultyComputer) else controller


def _where(condition, new, old):
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), new, old)
