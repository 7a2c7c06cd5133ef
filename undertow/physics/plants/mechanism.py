"""Base class of plants that are not bodies in water: an equation of motion and limits of the inputs."""

import abc
from dataclasses import replace
from typing import Any, ClassVar, NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from undertow.core.contracts import AbstractPlant, Effort, Inputs, Load, Measurement, Outputs
from undertow.core.signals import Signal
from undertow.core.status import Status
from undertow.physics.plants.reachability import open_loop_advice

Part = TypeVar("Part", bound=eqx.Module)


def nominal(truth: Part, **given: Any) -> Part:
    """The same part with other values of the named parameters; None leaves the true one."""
    return replace(truth, **{name: value for name, value in given.items() if value is not None})


class AbstractMechanism(AbstractPlant):
    """A plant given by its equation of motion and the limits of its inputs."""

    @abc.abstractmethod
    def limits(self) -> tuple[Inputs, Inputs]:
        """Smallest and largest input, (m,) each; infinite where there is no limit."""

    @abc.abstractmethod
    def power(self, x: PyTree, u: Inputs) -> Inputs:
        """Power of each input, W."""

    def inputs(self) -> int:
        return self.limits()[0].shape[0]

    def admissible(self, x: PyTree, u: Inputs) -> Inputs:
        return jnp.clip(u, *self.limits())

    def effort(self, x: PyTree, u: Inputs) -> Effort:
        """Power and saturation; an input that cannot be negative is not saturated at its smallest value."""
        low, high = self.limits()
        limited = (u >= high) | ((u <= low) & (low < 0))
        return Effort(self.power(x, u), limited.astype(u.dtype))

    def pose(self, x: PyTree) -> None:
        return None

    def advice(self) -> tuple[str, ...]:
        """Directions that no input can accelerate at zero, where there are any."""
        y = self.output(jnp.zeros(()), self.initial_state())
        return open_loop_advice("the gain matrix", self.model().dynamics.gain(y), self.outputs)

    def diagnostics(self, x: PyTree, u: Inputs) -> dict[str, Array]:
        return {}

    def signals(self) -> dict[str, Signal]:
        return {}


class MechanismState(NamedTuple):
    """Outputs (m, rad) and their rates (m/s, rad/s)."""

    position: Outputs
    velocity: Outputs


class AbstractOutputMechanism(AbstractMechanism):
    """A mechanism whose outputs and their rates are its whole state."""

    envelope: ClassVar[float] = 1e6  # m, rad, m/s, rad/s; far above plausible values

    def initial_state(self, position: Outputs | None = None, velocity: Outputs | None = None) -> MechanismState:
        n = len(self.outputs)
        return MechanismState(given_or_zero(position, n), given_or_zero(velocity, n))

    def dynamics(self, t, x: MechanismState, u: Inputs, d: Load) -> MechanismState:
        return MechanismState(x.velocity, self.acceleration(t, x, u, d))

    def output(self, t, x: MechanismState) -> Measurement:
        return Measurement(x.position, x.velocity)

    def status(self, x: MechanismState) -> Array:
        far = (jnp.abs(x.position) > self.envelope).any() | (jnp.abs(x.velocity) > self.envelope).any()
        return jnp.where(far, int(Status.DIVERGED), int(Status.OK))


def both_ways(limit: Float[Array, "..."], inputs: int) -> tuple[Inputs, Inputs]:
    """Symmetric limits of the inputs."""
    high = jnp.broadcast_to(limit, (inputs,))
    return -high, high


def given_or_zero(outputs: Outputs | None, count: int) -> Outputs:
    """Initial outputs, or zeros."""
    return jnp.zeros(count) if outputs is None else outputs
