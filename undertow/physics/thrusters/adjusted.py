"""A thruster like another one, with the gain and the lag that it has as installed on a vehicle."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel, Forces
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.thrusters.thruster import AbstractThruster, PerThruster, Powers, PropellerReport


class AdjustedThruster(AbstractThruster):
    """Thrust of another thruster times a gain, and its equations in a time that runs slower by `lag`.

    With x the state of the other thruster, x_dot = f(x, V) / lag. Its energies of rotors and windings are `lag` times
    larger, as inertia and inductance are that make it slower: the power balance stays closed.

    Raises:
        BadInput: a gain or the lag is not positive, or gains are for different numbers of thrusters.
    """

    thruster: AbstractThruster
    gain: Float[Param, "..."] = param("", "factor on thrust, in both directions", default=1.0)
    reverse_gain: Float[Param, "..."] = param("", "further factor on thrust in reverse", default=1.0)
    lag: Float[Param, ""] = param("", "factor on the time constants", default=1.0)

    def __check_init__(self):
        for name in ("gain", "reverse_gain", "lag"):
            checks.positive(name, getattr(self, name))
        self.count()

    # What a thruster is commanded with is that of the inner one.

    @property
    def supply(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.thruster.supply

    @property
    def dead_zone(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.thruster.dead_zone

    @property
    def dead_zone_kind(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.thruster.dead_zone_kind

    @property
    def input_unit(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.thruster.input_unit

    @property
    def has_prescribed_acceleration(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.thruster.has_prescribed_acceleration

    def limits(self):
        return self.thruster.limits()

    def terminal(self, voltage) -> PerThruster:
        return self.thruster.terminal(voltage)

    def count(self):
        for name in ("gain", "reverse_gain"):
            if np.ndim(getattr(self, name)) > 1:
                raise BadInput(name, "be one number, or one per thruster", f"of shape {np.shape(getattr(self, name))}")
        counts = {np.size(gain) for gain in (self.gain, self.reverse_gain) if np.ndim(gain) == 1}
        inner_count = self.thruster.count()
        if inner_count is not None:
            counts.add(inner_count)
        if len(counts) > 1:
            raise BadInput("gain", "be for as many thrusters as `reverse_gain` and `thruster`", sorted(counts))
        return counts.pop() if counts else None

    # Motion.

    def initial_state(self, count):
        return self.thruster.initial_state(count)

    def dynamics(self, state, voltage):
        return jax.tree.map(lambda rate: rate / self.lag, self.thruster.dynamics(state, voltage))

    def thrust(self, state, voltage) -> PerThruster:
        return adjusted_thrust(self.thruster.thrust(state, voltage), self.gain, self.reverse_gain)

    def current(self, state, voltage) -> PerThruster:
        return self.thruster.current(state, voltage)

    def electrical_power(self, state, voltage) -> PerThruster:
        return self.thruster.electrical_power(state, voltage)

    def powers(self, state, voltage) -> Powers | None:
        return self.thruster.powers(state, voltage)

    def stored(self, state) -> PerThruster:
        return self.lag * self.thruster.stored(state)

    def report(self, state) -> PropellerReport | None:
        report = self.thruster.report(state)
        if report is None or report.acceleration is None:
            return report
        return report._replace(acceleration=report.acceleration / self.lag)

    # Nominal model.

    def voltage_gain(self):
        """That of forward motion, as for a motor."""
        return self.gain * self.thruster.voltage_gain()

    def speed_term(self, report) -> PerThruster:
        """That of the inner thruster, times the gain; what the gain in reverse differs by is left in d."""
        if report is not None and report.acceleration is not None:
            report = report._replace(acceleration=report.acceleration * self.lag)
        return self.gain * self.thruster.speed_term(report)

    def actuator_model(self, count: int, measured: bool) -> "AdjustedActuator":
        inner = self.thruster.actuator_model(count, measured)
        return AdjustedActuator(inner, self.gain, self.reverse_gain, self.lag)

    def advice(self):
        return self.thruster.advice()


class AdjustedActuator(AbstractActuatorModel):
    """Actuators like others: their force times a gain, their equations in a time that runs slower by `lag`."""

    actuators: AbstractActuatorModel
    gain: Forces
    reverse_gain: Forces
    lag: Float[Param, ""]

    def max_bandwidth(self, sampled):
        return self.actuators.max_bandwidth(sampled * self.lag) / self.lag

    def time_constant(self):
        time_constant = self.actuators.time_constant()
        return None if time_constant is None else self.lag * time_constant

    def init(self):
        return self.actuators.init()

    def update_from_report(self, state, report):
        return self.actuators.update_from_report(state, report)

    def range(self, state, rate) -> tuple[Forces, Forces]:
        low, high = self.actuators.range(state, rate * self.lag)
        return self._adjusted(low), self._adjusted(high)

    def force(self, state, u) -> Forces:
        return self._adjusted(self.actuators.force(state, u))

    def command(self, state, force, rate):
        inner_force = force / (self.gain * jnp.where(force < 0, self.reverse_gain, 1.0))
        return self.actuators.command(state, inner_force, rate * self.lag)

    def target_of(self, state, u, rate) -> Forces:
        return self._adjusted(self.actuators.target_of(state, u, rate * self.lag))

    def advance(self, state, u, dt):
        return self.actuators.advance(state, u, dt / self.lag)

    def dead_zone(self):
        return self.actuators.dead_zone()

    def quasi_static(self) -> "AdjustedActuator":
        return AdjustedActuator(self.actuators.quasi_static(), self.gain, self.reverse_gain, self.lag)

    def _adjusted(self, force: Forces) -> Forces:
        return adjusted_thrust(force, self.gain, self.reverse_gain)


def adjusted_thrust(thrust: PerThruster, gain: PerThruster, reverse_gain: PerThruster) -> PerThruster:
    """Thrust, N, times the gain of its direction."""
    return gain * jnp.where(thrust < 0, reverse_gain, 1.0) * thrust


def adjusted(thruster: AbstractThruster, gain=1.0, reverse_gain=1.0, lag: float = 1.0) -> AdjustedThruster:
    """Another thruster as installed on a vehicle: its thrust times a gain, its time constants times a factor.

    Thrust on a vehicle differs from that on a test bench: the hull takes a part of it (thrust deduction), and so does
    the wash of other propellers. Current, power and limits are those of the other thruster. Laws know gains and lag.

    Args:
        thruster: the other one.
        gain: factor on thrust in both directions; one number, or one per thruster.
        reverse_gain: further factor on thrust in reverse; one number, or one per thruster.
        lag: factor on the time constants.
    """
    return AdjustedThruster(thruster=thruster, gain=gain, reverse_gain=reverse_gain, lag=lag)  # pyright: ignore[reportCallIssue] - abstract fields are no arguments
