"""The controller's model of the actuators, which turn its input into the force that moves the plant."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from undertow.core.arrays import as_array

Inputs = Float[Array, " m"]
Forces = Float[Array, " m"] | Float[Array, ""]  # one per input, or one that holds for each


class AbstractActuatorModel(eqx.Module):
    """Map from input to force and back, with a state of its own (propeller speeds, for instance)."""

    @abc.abstractmethod
    def max_bandwidth(self, sampled: Float[Array, ""]) -> Float[Array, ""]:
        """Largest bandwidth of the actuator loop, 1/s, where the sampling time allows `sampled` (1/s)."""

    @abc.abstractmethod
    def time_constant(self) -> Float[Array, "..."] | None:
        """Nominal time constant of the force, s: 0 where it follows the input at once, None where it is unknown."""

    @abc.abstractmethod
    def init(self) -> PyTree:
        """State at rest."""

    @abc.abstractmethod
    def update_from_report(self, state: PyTree, report: PyTree) -> PyTree:
        """State corrected by the report of the actuators."""

    @abc.abstractmethod
    def range(self, state: PyTree, rate: Float[Array, ""]) -> tuple[Forces, Forces]:
        """Smallest and largest force that can be commanded within the limits of the input."""

    @abc.abstractmethod
    def force(self, state: PyTree, u: Inputs) -> Forces:
        """Force that an applied input gives."""

    @abc.abstractmethod
    def command(self, state: PyTree, force: Forces, rate: Float[Array, ""]) -> Inputs:
        """Input that brings the force to a desired one, at `rate` (1/s) where it cannot follow at once."""

    @abc.abstractmethod
    def target_of(self, state: PyTree, u: Inputs, rate: Float[Array, ""]) -> Forces:
        """Force towards which an input drives the actuators: the inverse of `command`."""

    @abc.abstractmethod
    def advance(self, state: PyTree, u: Inputs, dt: Float[Array, ""]) -> PyTree:
        """State one sampling time later, with the input held."""

    @abc.abstractmethod
    def dead_zone(self) -> Float[Array, ""]:
        """Largest input without effect, as a share of the limit of the input."""

    @abc.abstractmethod
    def quasi_static(self) -> "AbstractActuatorModel":
        """The same actuators without their dynamics: the force follows the input at once."""


class AbstractMemorylessActuator(AbstractActuatorModel):
    """Actuators whose force follows the input at once; there is no state."""

    def max_bandwidth(self, sampled):
        return sampled

    def init(self) -> tuple[()]:
        return ()

    def update_from_report(self, state, report) -> tuple[()]:
        return ()

    def target_of(self, state, u, rate):
        return self.force(state, u)

    def advance(self, state, u, dt) -> tuple[()]:
        return ()

    def quasi_static(self):
        return self


class DirectActuator(AbstractMemorylessActuator):
    """The force is proportional to the input, within limits of the input."""

    gain: Forces = eqx.field(converter=as_array, default=1.0)
    low: Forces = eqx.field(converter=as_array, default=-jnp.inf)
    high: Forces = eqx.field(converter=as_array, default=jnp.inf)
    at_once: bool = eqx.field(static=True, default=True)  # whether the force is known to follow the input at once

    def time_constant(self):
        return jnp.zeros(()) if self.at_once else None

    def range(self, state, rate):
        return self.gain * self.low, self.gain * self.high

    def force(self, state, u):
        return self.gain * u

    def command(self, state, force, rate):
        return force / self.gain

    def dead_zone(self):
        return jnp.zeros(())


class LaggedActuator(AbstractActuatorModel):
    """Actuators whose force follows a steady curve with a first-order lag: tau f_dot + f = f_steady(u).

    The force in the state is the solution of this equation for the input that was applied.
    """

    curve: AbstractActuatorModel  # without memory
    tau: Float[Array, ""] = eqx.field(converter=jnp.asarray)  # s
    count: int = eqx.field(static=True)

    def max_bandwidth(self, sampled):
        return jnp.maximum(sampled, 1 / self.tau)  # its own bandwidth costs no extra input

    def time_constant(self):
        return self.tau

    def init(self) -> Forces:
        return jnp.zeros(self.count)

    def update_from_report(self, state, report) -> Forces:
        return state

    def range(self, state, rate):
        """Forces that the limits of the input allow at `rate`."""
        low, high = (jnp.broadcast_to(limit, (self.count,)) for limit in self.curve.range((), rate))
        lead = self.tau * rate
        limited = jnp.isfinite(low) & jnp.isfinite(high)
        towards = lambda limit: state + (jnp.where(limited, limit, 0.0) - state) / lead
        return jnp.where(limited, towards(low), -jnp.inf), jnp.where(limited, towards(high), jnp.inf)

    def force(self, state, u):
        return state

    def command(self, state, force, rate):
        return self.curve.command((), state + self.tau * rate * (force - state), rate)

    def target_of(self, state, u, rate):
        return state + (self.curve.force((), u) - state) / (self.tau * rate)

    def advance(self, state, u, dt):
        """Exact for an input that is held."""
        return state + (self.curve.force((), u) - state) * -jnp.expm1(-dt / self.tau)

    def dead_zone(self):
        return self.curve.dead_zone()

    def quasi_static(self) -> AbstractActuatorModel:
        return self.curve


def force_of(actuators: AbstractActuatorModel, u: Inputs) -> Forces:
    """Force that an input gives in steady state."""
    held = actuators.quasi_static()
    return held.force(held.init(), u)
