"""A control law that goes on when thrusters fail: it notices which, and allocates without them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.controllers.bandwidths import largest_forces
from undertow.control.supervision.reduced_model import attained_share, default_priority, reduced
from undertow.control.supervision.thruster_monitor import MonitorState, ThrusterMonitor
from undertow.core import checks
from undertow.core.contracts import AbstractController, Measurement, Model, Target
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.core.runtime import double_outside_runs
from undertow.core.signals import Signal

PerActuator = Float[Array, " m"]

# Loss of the attained share by which an axis counts as lost.
_LOST = 0.15

_SIGNALS = {
    "lost_thrusters": Signal(("actuator",), "1", "1 for an actuator that has failed and is no longer used"),
    "lost_axes": Signal(("axis",), "1", "1 for a body axis that the remaining actuators can no longer control"),
    "fault_evidence": Signal((), "1", "evidence that one actuator has failed, relative to the threshold"),
}


class FaultTolerantState(NamedTuple):
    """State z of the law, and what is known of its actuators."""

    law: Any
    monitor: MonitorState


class FaultTolerantController(AbstractController):
    """A law whose failed actuators are detected and taken out of the allocation.

    A failed actuator gets the command 0, and the law a model without it. What a stuck one still gives is a load to the
    law. An actuator with an alarm stays lost; one that announces that it has failed (`Measurement.health`) is not used
    while it does. While nothing is lost, commands and state of the law are those without this wrapper, to the last bit.
    """

    law: AbstractController
    monitor: ThrusterMonitor
    own: Model | None  # in body axes, where that of the law is not
    priority: Float[Param, " n"] = param("", "weight of each axis where not all can be controlled")

    @property
    def body_model(self) -> Model:
        """Nominal model in body axes. It is the law's own if that is: what both compute of it is computed once."""
        return self.law.model if self.own is None else self.own

    @property
    def model(self) -> Model:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Nominal model of the law, with every actuator."""
        return self.law.model

    def init(self, y: Measurement, r: Target) -> FaultTolerantState:
        return FaultTolerantState(self.law.init(y, r), self.monitor.init(self.body_model, y))

    def knowledge(self, z: FaultTolerantState) -> MonitorState:
        """What is known of the actuators: what is lost stays lost."""
        return z.monitor

    def restarted(self, knowledge: MonitorState, y: Measurement, r: Target) -> FaultTolerantState:
        return FaultTolerantState(self._reduced(self._used(knowledge, y)).init(y, r), knowledge)

    def command(self, z: FaultTolerantState, y: Measurement, r: Target):
        used = self._used(z.monitor, y)
        u, signals = self._reduced(used).command(z.law, y, r)
        fault_signals = {
            "lost_thrusters": 1.0 - used,
            "lost_axes": self._lost_axes(used, y),
            "fault_evidence": z.monitor.evidence,
        }
        return jnp.where(used > 0, u, 0.0), signals | fault_signals

    def advance(self, z: FaultTolerantState, y: Measurement, r: Target, u_applied, dt) -> FaultTolerantState:
        used = self._used(z.monitor, y)
        law = self._reduced(used).advance(z.law, y, r, u_applied, dt)
        return FaultTolerantState(law, self.monitor.advance(z.monitor, self.body_model, y, u_applied, used, dt))

    def known_acceleration(self, z: FaultTolerantState, y: Measurement, u_applied):
        return self._reduced(self._used(z.monitor, y)).known_acceleration(z.law, y, u_applied)

    def signals(self):
        return self.law.signals() | _SIGNALS

    def _used(self, monitor: MonitorState, y: Measurement) -> PerActuator:
        """1 for an actuator that has neither an alarm nor announced that it has failed, else 0."""
        used = 1.0 - monitor.lost
        return used if y.health is None else jnp.where(jnp.asarray(y.health) < 0.5, 0.0, used)

    def _reduced(self, used: PerActuator) -> AbstractController:
        return eqx.tree_at(lambda law: law.model, self.law, reduced(self.law.model, used, self.priority))

    def _lost_axes(self, used: PerActuator, y: Measurement) -> Float[Array, " n"]:
        gain, everything = self.body_model.dynamics.gain(y), jnp.ones_like(used)
        share = lambda used: attained_share(gain, used, self.priority)
        lost_axes = lambda: jnp.where(share(everything) - share(used) > _LOST, 1.0, 0.0)
        return jax.lax.cond((used < 1).any(), lost_axes, lambda: jnp.zeros_like(self.priority))


@double_outside_runs
def fault_tolerant(
    law: AbstractController,
    sampling_time: float,
    limits: tuple[Any, Any] | None = None,
    *,
    priority=None,
    **monitor: Any,
) -> FaultTolerantController:
    """A law that notices failed actuators and goes on without them.

    Args:
        law: any with a model, made from `plant.model()`.
        sampling_time: that of the loop, s, between 1 ms and 0.1 s.
        limits: smallest and largest input, in its unit, one number or one per actuator; None: as the model says. An
            actuator without a limit is taken to be able to accelerate the plant by 1 m/s^2.
        priority: weight of each axis where not all can be controlled; None: for a vehicle 1 for surge, sway and heave,
            0.1 for roll and pitch, 0.3 for yaw; else 1.
        monitor: other numbers of `ThrusterMonitor`, by name.

    Raises:
        BadInput: a value is out of its range, or no parameter of the monitor.
    """
    checks.positive("sampling_time", sampling_time, "s")
    body_model = law.model.in_body_axes()
    effect = np.asarray(_gain_at_rest(body_model))
    largest = _largest(body_model, effect, limits)
    unit = 0.02 * np.abs(effect * largest).max(1)
    option_names = set(ThrusterMonitor.__dataclass_fields__) - {"unit", "largest"}
    for name in monitor:
        if name not in option_names:
            raise BadInput(name, f"be one of {', '.join(sorted(option_names))}")
    options = {"persistence": max(0.05, 2.5 * sampling_time)} | monitor
    watch = ThrusterMonitor(np.where(unit > 0, unit, 1.0), largest, **options)
    priority = default_priority(law.model) if priority is None else priority
    checks.positive("priority", priority)
    priority = np.broadcast_to(np.asarray(priority, dtype=float), (effect.shape[0],))
    return FaultTolerantController(law, watch, None if body_model is law.model else body_model, priority)  # pyright: ignore[reportArgumentType] - an abstract field is no argument


def _gain_at_rest(model: Model):
    """Acceleration per force with all outputs zero."""
    zero = jnp.zeros(len(model.coordinates.angles))
    return model.dynamics.gain(model.coordinates.measurement(zero, zero))


def _largest(model: Model, effect: np.ndarray, limits: tuple[Any, Any] | None) -> np.ndarray:
    """Largest force of each actuator."""
    count = effect.shape[1]
    largest = np.asarray(largest_forces(model.actuators, count))
    if limits is not None:
        held = model.actuators.quasi_static()
        ends = [np.broadcast_to(np.asarray(end, dtype=float), (count,)) for end in limits]
        force = lambda end: np.abs(np.asarray(held.force(held.init(), jnp.asarray(np.where(np.isfinite(end), end, 0)))))
        forces = [np.where(np.isfinite(end), force(end), np.inf) for end in ends]
        largest = np.minimum(largest, np.maximum(*forces))
    linear = ~np.asarray(model.coordinates.angles)
    strongest = np.abs(effect[linear] if linear.any() else effect).max(0)
    unlimited = 1 / np.where(strongest > 0, strongest, 1.0)
    return np.where(largest < 1e5, largest, unlimited)
