"""What a controller knows of what stands between its input and the force that moves the plant."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

Inputs = Float[Array, " m"]
Forces = Float[Array, " m"]


# Share of what sampling allows, for actuators of which nobody knows how fast they are.
_UNKNOWN = 0.43


class AbstractDrive(eqx.Module):
    """From input to force and back, with what the controller remembers of it (propeller speeds, for instance)."""

    @abc.abstractmethod
    def quickest(self, sampled: Float[Array, ""]) -> Float[Array, ""]:
        """Rate, 1/s, at which it can be made to follow where sampling allows `sampled` (1/s)."""

    @abc.abstractmethod
    def lag(self, rate: Float[Array, ""]) -> Float[Array, ""]:
        """Time constant of the force, s, where actuators are made to follow at a rate (1/s)."""

    @abc.abstractmethod
    def init(self) -> PyTree:
        """State at rest."""

    @abc.abstractmethod
    def heard(self, state: PyTree, report: PyTree) -> PyTree:
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
    def aim(self, state: PyTree, u: Inputs, rate: Float[Array, ""]) -> Forces:
        """Force that an input is on its way to: `command` solved."""

    @abc.abstractmethod
    def advance(self, state: PyTree, u: Inputs, dt: Float[Array, ""]) -> PyTree:
        """State after a sampling time with an input held."""

    def steady(self) -> "AbstractDrive":
        """The same actuators taken for ones that follow at once."""
        return self


class DirectDrive(AbstractDrive):
    """The force is proportional to the input, within limits of the input."""

    gain: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=1.0)
    low: Inputs = eqx.field(converter=jnp.asarray, default=-jnp.inf)
    high: Inputs = eqx.field(converter=jnp.asarray, default=jnp.inf)
    time_constant: Float[Array, ""] | None = None  # s, of a lag that the drive itself leaves out; None: not known

    def quickest(self, sampled):
        return _UNKNOWN * sampled if self.time_constant is None else sampled

    def lag(self, rate):
        return 1 / rate if self.time_constant is None else jnp.asarray(self.time_constant, dtype=float)

    def init(self) -> tuple[()]:
        return ()

    def heard(self, state, report) -> tuple[()]:
        return ()

    def range(self, state, rate):
        return self.gain * self.low, self.gain * self.high

    def force(self, state, u):
        return self.gain * u

    def command(self, state, force, rate):
        return force / self.gain

    def aim(self, state, u, rate):
        return self.gain * u

    def advance(self, state, u, dt) -> tuple[()]:
        return ()
