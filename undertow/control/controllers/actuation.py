"""From a demanded acceleration to inputs: the path that laws with acceleration as output share.

A law decides an acceleration; everything after it is common: the modelled forces are compensated, as they are at the
velocity of the target, the model is inverted, forces are allocated within the limits of the actuators, and the
actuators are commanded. What limits took away comes back to the law as `ActuationResult`, so that it need not wind up.
"""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from undertow.control.controllers.options import ActuationOptions
from undertow.control.controllers.reference_filter import FilterState, ReferenceFilter
from undertow.control.controllers.thruster_allocation import allocate, attained
from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import AbstractController, Measurement, Target, TrackingError
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param

PerAxis = Float[Array, " n"]

MOTORS = ("steady", "computed")


class Actuation(eqx.Module):
    """How a demanded acceleration is carried out.

    Raises:
        BadInput: `actuator_rate` or `direction` not positive, or an unknown `motor`.
    """

    filter: ReferenceFilter | None
    actuator_rate: Float[Param, ""] = param("1/s", "bandwidth of the actuator loop", symbol="lambda")
    direction: Float[Param, ""] = param("", "cost of a departure from the desired direction relative to a loss of size")
    feedforward: bool = eqx.field(static=True, default=True)
    motor: str = eqx.field(static=True, default="steady")

    def __check_init__(self):
        checks.choice("motor", self.motor, MOTORS)
        for name in ("actuator_rate", "direction"):
            checks.positive(name, getattr(self, name))


class ActuatedState(NamedTuple):
    """State z: that of the law itself, and that of the path."""

    law: Any
    actuators: Any  # estimated state of the actuators
    filter: FilterState | None


class ActuationResult(NamedTuple):
    """What the applied input gives."""

    modelled: PerAxis  # modelled acceleration F + G f, m/s^2, rad/s^2
    missing: PerAxis  # acceleration that the actuators are driven to, less the demanded one: what limits take, and
    # along directions in which no actuator acts all of it
    share: Float[Array, ""]  # of the demanded acceleration, along its direction, 0 to 1


class ActuationDecisions(NamedTuple):
    """Decisions of one instant."""

    actuators: Any
    tracking_error: TrackingError
    desired: PerAxis  # of the actuators: the demanded acceleration less what the model compensates
    forces: Float[Array, " m"]  # for that, without limits
    signals: dict[str, Array]


class AbstractAccelerationLaw(AbstractController):
    """A law given by the acceleration that it demands: `init_law`, `acceleration` and `update`."""

    actuation: eqx.AbstractVar[Actuation]

    @abc.abstractmethod
    def init_law(self, y: Measurement, r: Target) -> PyTree:
        """State of the law itself before the first measurement is used."""

    @abc.abstractmethod
    def acceleration(
        self, state: PyTree, y: Measurement, tracking_error: TrackingError
    ) -> tuple[PerAxis, dict[str, Array]]:
        """Acceleration, m/s^2 and rad/s^2, and the values of the law's signals.

        Args:
            state: of the law.
            y: measurement.
            tracking_error: errors from the target after the filter of jumps, and its acceleration.
        """

    @abc.abstractmethod
    def update(
        self,
        state: PyTree,
        y: Measurement,
        tracking_error: TrackingError,
        actuation: ActuationResult,
        dt: Float[Array, ""],
    ) -> PyTree:
        """State of the law one sampling time later."""

    def init(self, y: Measurement, r: Target) -> ActuatedState:
        smoothing = None if self.actuation.filter is None else self.actuation.filter.init(y.position)
        return ActuatedState(self.init_law(y, r), self._actuators().init(), smoothing)

    def command(self, z: ActuatedState, y: Measurement, r: Target):
        path, plan, actuators, effect = self.actuation, self._plan(z, y, r), self._actuators(), self._effect(y)
        forces = allocate(effect, plan.forces, *actuators.range(plan.actuators, path.actuator_rate), path.direction)
        u = actuators.command(plan.actuators, forces, path.actuator_rate)
        return u, plan.signals | {"attained_share": attained(effect, plan.forces, forces)}

    def advance(self, z: ActuatedState, y: Measurement, r: Target, u_applied, dt) -> ActuatedState:
        path, plan, actuators, effect = self.actuation, self._plan(z, y, r), self._actuators(), self._effect(y)
        forces_of = lambda u: actuators.target_of(plan.actuators, u, path.actuator_rate)
        intended = forces_of(actuators.command(plan.actuators, plan.forces, path.actuator_rate))
        actual = forces_of(u_applied)
        share = attained(effect, intended, actual)
        modelled = self._drift(y) + matvec(effect, actuators.force(plan.actuators, u_applied))
        missing = matvec(effect, actual - intended + plan.forces) - plan.desired
        coordinates = self.model.coordinates
        return ActuatedState(
            law=self.update(z.law, y, plan.tracking_error, ActuationResult(modelled, missing, share), dt),
            actuators=actuators.advance(plan.actuators, u_applied, dt),
            filter=None if path.filter is None else path.filter.advance(z.filter, r, coordinates, share, dt),  # pyright: ignore[reportArgumentType] - a law with a filter has its state
        )

    def known_acceleration(self, z: ActuatedState, y: Measurement, u_applied) -> PerAxis:
        actuators = self._actuators()
        forces = actuators.force(actuators.update_from_report(z.actuators, y.actuator), u_applied)
        return self._drift(y) + matvec(self._effect(y), forces)

    def _actuators(self) -> AbstractActuatorModel:
        actuators = self.model.actuators
        return actuators.quasi_static() if self.actuation.motor == "steady" else actuators

    def _effect(self, y: Measurement) -> Float[Array, "n m"]:
        return self.model.dynamics.gain(y)

    def _within_reach(self, y: Measurement, values: PerAxis) -> PerAxis:
        """What the actuators give of an acceleration: all of it, but for directions in which none acts."""
        return matvec(self._effect(y), self.model.dynamics.invert(y, values))

    def _drift(self, y: Measurement) -> PerAxis:
        return self.model.dynamics.drift(y) if self.actuation.feedforward else jnp.zeros_like(y.position)

    def _compensated(self, y: Measurement, tracking_error: TrackingError) -> PerAxis:
        if not self.actuation.feedforward:
            return jnp.zeros_like(y.position)
        return self.model.drift_at_target_velocity(y, tracking_error.rate)

    def _plan(self, z: ActuatedState, y: Measurement, r: Target) -> ActuationDecisions:
        dynamics, coordinates, _ = self.model
        smoothing = self.actuation.filter
        target = r if smoothing is None else smoothing.smoothed(z.filter, r, coordinates)  # pyright: ignore[reportArgumentType] - a law with a filter has its state
        tracking_error = coordinates.tracking_error(y, target)
        acceleration, signals = self.acceleration(z.law, y, tracking_error)
        desired = acceleration - self._compensated(y, tracking_error)
        estimated = self._actuators().update_from_report(z.actuators, y.actuator)
        return ActuationDecisions(estimated, tracking_error, desired, dynamics.invert(y, desired), signals)


def actuation_for(sampling_time: float, frequency, options: ActuationOptions = ActuationOptions()) -> Actuation:
    """The path of a law, with its defaults.

    Args:
        sampling_time: that of the loop, s.
        frequency: natural frequency of the closed loop, rad/s; one number or one per axis.
        options: of the law.

    Raises:
        BadInput: a value is out of its range.
    """
    reference_frequency = options.reference_frequency
    if reference_frequency is None:
        reference_frequency = jnp.minimum(jnp.asarray(frequency, dtype=float) / 2, 2.0)
    unfiltered = not checks.assumed(lambda frequency: (frequency != 0).any(), reference_frequency)
    return Actuation(
        filter=None if unfiltered else ReferenceFilter(reference_frequency),
        actuator_rate=0.15 / sampling_time if options.actuator_rate is None else options.actuator_rate,
        direction=options.direction,
        feedforward=options.feedforward,
        motor=options.motor,
    )
