"""What a controller knows of what stands between its input and the force that moves the plant."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

Inputs = Float[Array, " m"]
Forces = Float[Array, " m"]


class AbstractActuatorModel(eqx.Module):
    """From input to force and back, with what the controller remembers of it (propeller speeds, for instance)."""

    @abc.abstractmethod
    def max_bandwidth(self, sampled: Float[Array, ""]) -> Float[Array, ""]:
        """Rate, 1/s, at which it can be made to follow where sampling allows `sampled` (1/s)."""

    @abc.abstractmethod
    def time_constant(self) -> Float[Array, "..."] | None:
        """Nominal lag of the force behind the input, s: 0 where it follows at once, None where nobody knows."""

    @abc.abstractmethod
    def init(self) -> PyTree:
        """State at rest."""

    @abc.abstractmethod
    def update_from_report(self, state: PyTree, report: PyTree) -> PyTree:
        """State with what the actuators report of themselves put into it."""

    @abc.abstractmethod
    def range(self, state: PyTree, rate: Float[Array, ""]) -> tuple[Forces, Forces]:
        """Smallest and largest force that may be asked for without asking for more input than there is."""

    @abc.abstractmethod
    def force(self, state: PyTree, u: Inputs) -> Forces:
        """Force that an applied input gives."""

    @abc.abstractmethod
    def command(self, state: PyTree, force: Forces, rate: Float[Array, ""]) -> Inputs:
        """Input that brings the force to a wanted one, as fast as `rate` (1/s) where it cannot be at once."""

    @abc.abstractmethod
    def target_of(self, state: PyTree, u: Inputs, rate: Float[Array, ""]) -> Forces:
        """Force that an input is on its way to: `command` solved."""

    @abc.abstractmethod
    def advance(self, state: PyTree, u: Inputs, dt: Float[Array, ""]) -> PyTree:
        """State after a sampling time with an input held."""

    @abc.abstractmethod
    def quasi_static(self) -> "AbstractActuatorModel":
        """The same actuators taken for ones that follow at once."""


class DirectActuator(AbstractActuatorModel):
    """The force is proportional to the input, within limits of the input."""

    gain: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=1.0)
    low: Inputs = eqx.field(converter=jnp.asarray, default=-jnp.inf)
    high: Inputs = eqx.field(converter=jnp.asarray, default=jnp.inf)
    at_once: bool = eqx.field(static=True, default=True)  # whether the force is known to follow the input at once

    def max_bandwidth(self, sampled):
        return sampled

    def time_constant(self):
        return jnp.zeros(()) if self.at_once else None

    def init(self) -> tuple[()]:
        return ()

    def update_from_report(self, state, report) -> tuple[()]:
        return ()

    def range(self, state, rate):
        return self.gain * self.low, self.gain * self.high

    def force(self, state, u):
        return self.gain * u

    def command(self, state, force, rate):
        return force / self.gain

    def target_of(self, state, u, rate):
        return self.gain * u

    def advance(self, state, u, dt) -> tuple[()]:
        return ()

    def quasi_static(self) -> "DirectActuator":
        return self


class LaggedActuator(AbstractActuatorModel):
    """Actuators whose force follows that of a steady curve with a first-order lag: tau f_dot + f = f_steady(u).

    The force is that of the same equation, driven by the input that was applied.
    """

    curve: AbstractActuatorModel  # without memory
    tau: Float[Array, ""] = eqx.field(converter=jnp.asarray)  # s
    count: int = eqx.field(static=True)

    def max_bandwidth(self, sampled):
        return jnp.maximum(sampled, 1 / self.tau)  # no faster than it is by itself costs nothing

    def time_constant(self):
        return self.tau

    def init(self) -> Forces:
        return jnp.zeros(self.count)

    def update_from_report(self, state, report) -> Forces:
        return state

    def range(self, state, rate):
        """Forces towards which the limits of the input drive the force within 1 / rate."""
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
        """Exactly, for an input that is held."""
        return state + (self.curve.force((), u) - state) * -jnp.expm1(-dt / self.tau)

    def quasi_static(self) -> AbstractActuatorModel:
        return self.curve


def input_for(actuators: AbstractActuatorModel, force: Forces) -> Inputs:
    """Input that holds a force, as if the actuators followed at once."""
    held = actuators.quasi_static()
    return held.command(held.init(), force, jnp.ones(()))


def force_of(actuators: AbstractActuatorModel, u: Inputs) -> Forces:
    """Force that an input holds, as if the actuators followed at once."""
    held = actuators.quasi_static()
    return held.force(held.init(), u)
