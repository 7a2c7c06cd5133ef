"""PID control as marine engineers design it: the baseline of comparisons."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.controllers.bandwidths import alike, axes_of, pid_frequency
from undertow.controllers.law_signals import ATTAINED_SHARE, ESTIMATE
from undertow.controllers.reference_filter import FilterState, ReferenceFilter
from undertow.controllers.thruster_allocation import allocate, attained
from undertow.core import checks
from undertow.core.actuator_model import AbstractActuatorModel
from undertow.core.contracts import AbstractInformedController, Measurement, Model, Target
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.numerics.linear_algebra import matvec

PerAxis = Float[Array, " n"]

MOTORS = ("steady", "computed")


class PIDState(NamedTuple):
    """State z of the law."""

    integral: PerAxis  # acceleration of the integral, m/s^2, rad/s^2
    actuators: Any  # estimated state of the actuators
    filter: FilterState | None


class Plan(NamedTuple):
    """Decisions of one instant."""

    actuators: Any
    error: PerAxis  # m, rad
    forces: Float[Array, " m"]  # for the desired acceleration, without limits


class PID(AbstractInformedController):
    """a = a_d + k_p e + k_d e_dot + integral of k_i e, in the model's own axes; forces within limits; no windup.

    Raises:
        BadInput: a gain of the wrong sign, or an integral too strong for a stable loop: k_i < k_p k_d (Routh).
    """

    model: Model
    filter: ReferenceFilter | None
    proportional: Float[Param, "..."] = param("1/s^2", "acceleration per error", symbol="k_p")
    integral: Float[Param, "..."] = param("1/s^3", "rate of the acceleration per error", symbol="k_i")
    derivative: Float[Param, "..."] = param("1/s", "acceleration per error of the rates", symbol="k_d")
    actuator_rate: Float[Param, ""] = param("1/s", "bandwidth of the actuator loop", symbol="lambda")
    direction: Float[Param, ""] = param("", "cost of a departure from the desired direction relative to a loss of size")
    feedforward: bool = eqx.field(static=True, default=True)
    motor: str = eqx.field(static=True, default="steady")

    def __check_init__(self):
        checks.choice("motor", self.motor, MOTORS)
        checks.not_negative("integral", self.integral, "1/s^3")
        for name in ("proportional", "derivative", "actuator_rate", "direction"):
            checks.positive(name, getattr(self, name))
        for name in ("proportional", "integral", "derivative"):
            checks.per_axis(name, getattr(self, name), len(self.model.coordinates.angles))
        most = self.proportional * self.derivative
        if not checks.assumed(lambda gain, most: (gain < most).all(), self.integral, most):
            worst = np.asarray(self.integral / most).max()
            raise BadInput("integral", "be less than proportional times derivative", f"{worst:g} times that")

    def init(self, y: Measurement, r: Target) -> PIDState:
        smoothing = None if self.filter is None else self.filter.init(y.position)
        return PIDState(jnp.zeros_like(y.position), self._actuators().init(), smoothing)

    def command(self, z: PIDState, y: Measurement, r: Target):
        plan, actuators, effect = self._plan(z, y, r), self._actuators(), self.model.dynamics.gain(y)
        forces = allocate(effect, plan.forces, *actuators.range(plan.actuators, self.actuator_rate), self.direction)
        signals = {"estimate": -z.integral, "attained_share": attained(effect, plan.forces, forces)}
        return actuators.command(plan.actuators, forces, self.actuator_rate), signals

    def advance(self, z: PIDState, y: Measurement, r: Target, u_applied, dt) -> PIDState:
        """Anti-windup of the integral by back-calculation, Astrom and Murray (2008), 10.4.

        Its time constant is the geometric mean of those of integral and derivative, or one step where that is longer.
        """
        plan, actuators, effect = self._plan(z, y, r), self._actuators(), self.model.dynamics.gain(y)
        heading = lambda u: actuators.target_of(plan.actuators, u, self.actuator_rate)
        asked, going = heading(actuators.command(plan.actuators, plan.forces, self.actuator_rate)), heading(u_applied)
        back = jnp.minimum(jnp.sqrt(self.integral / self.derivative), 1 / dt) * matvec(effect, going - asked)
        share = attained(effect, asked, going)
        return PIDState(
            integral=z.integral + dt * (self.integral * plan.error + back),
            actuators=actuators.advance(plan.actuators, u_applied, dt),
            filter=None if self.filter is None else self.filter.advance(z.filter, r, self.model.coordinates, share, dt),  # pyright: ignore[reportArgumentType] - a law with a filter has its state
        )

    def known_acceleration(self, z: PIDState, y: Measurement, u_applied) -> PerAxis:
        actuators = self._actuators()
        given = actuators.force(actuators.update_from_report(z.actuators, y.actuator), u_applied)
        return self._drift(y) + matvec(self.model.dynamics.gain(y), given)

    def signals(self):
        return ESTIMATE | ATTAINED_SHARE

    def _actuators(self) -> AbstractActuatorModel:
        actuators = self.model.actuators
        return actuators.quasi_static() if self.motor == "steady" else actuators

    def _drift(self, y: Measurement) -> PerAxis:
        return self.model.dynamics.drift(y) if self.feedforward else jnp.zeros_like(y.position)

    def _plan(self, z: PIDState, y: Measurement, r: Target) -> Plan:
        dynamics, coordinates, _ = self.model
        target = r if self.filter is None else self.filter.smoothed(z.filter, r, coordinates)  # pyright: ignore[reportArgumentType] - a law with a filter has its state
        error, rate, acceleration = coordinates.tracking_error(y, target)
        demand = acceleration + self.proportional * error + self.derivative * rate + z.integral - self._drift(y)
        return Plan(self._actuators().update_from_report(z.actuators, y.actuator), error, dynamics.invert(y, demand))


def pid(
    model: Model,
    *,
    sampling_time: float = 1e-3,
    velocity_noise=0.0,
    load_rate=1.0,
    delay: float = 0.0,
    frequency=None,
    damping=1.0,
    integral_share=0.1,
    gains=None,
    feedforward: bool = True,
    motor: str = "steady",
    reference_frequency=None,
    actuator_rate=None,
    direction=1.0,
) -> PID:
    """PID with acceleration as output, by pole placement, Fossen (2021), ch. 15. Body axes and quaternions.

    Args:
        model: nominal model, from `plant.model()`.
        sampling_time: that of the loop, s; a scenario sets it. From Python, give the `dt` of `simulate`: gains for a
            shorter one track more closely, but with less margin and more chattering than the rule allows.
        velocity_noise: standard deviation of the measured velocities at each sampling time, m/s and rad/s; one number
            or one per axis; a scenario sets it from its navigation.
        load_rate: random walk of the loads, m/s^2 and rad/s^2 per sqrt(s); used only with noise.
        delay: that of measurement and input together, s.
        frequency: natural frequency w of the closed loop without its integral, rad/s; one number or one per axis. None:
            as in preset `robust`, the one of least predicted cost that keeps the margins of `bandwidths.py`.
        damping: damping ratio of the closed loop without its integral.
        integral_share: k_i = share w k_p with k_p = w^2; a tenth is Fossen's. 0 for PD.
        gains: (k_p, k_i, k_d) instead of these three, 1/s^2, 1/s^3 and 1/s; one triple or one per axis.
        feedforward: whether weight, buoyancy, drag and the other modelled forces are compensated.
        motor: steady, the voltage is that of the thrust in steady state, or computed, the motor's lag is compensated.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of the natural frequency, 2 at
            most; 0 for no filter.
        actuator_rate: with motor = computed, bandwidth of the motor loop, 1/s; None: 0.15 per sampling time.
        direction: cost of a departure from the desired direction, where limits bind, relative to a loss of size.

    Raises:
        BadInput: a value is out of its range.
    """
    checks.positive("sampling_time", sampling_time, "s")
    model = model.in_body_axes()
    if gains is None:
        if frequency is None:
            axes = axes_of(model, sampling_time, delay, velocity_noise, load_rate)
            frequency = alike([pid_frequency(axis) for axis in axes])
        for name, value, check in (
            ("frequency", frequency, checks.positive),
            ("damping", damping, checks.positive),
            ("integral_share", integral_share, checks.not_negative),
        ):
            checks.per_axis(name, value, len(model.coordinates.angles))
            check(name, value)
        w, zeta, share = (jnp.asarray(value, dtype=float) for value in (frequency, damping, integral_share))
        proportional, integral, derivative = w**2, share * w**3, 2 * zeta * w
    else:
        checks.per_axis("gains", gains, len(model.coordinates.angles), (3,))
        proportional, integral, derivative = jnp.moveaxis(jnp.asarray(gains, dtype=float), -1, 0)
    if reference_frequency is None:
        reference_frequency = jnp.minimum(jnp.sqrt(proportional) / 2, 2.0)
    unfiltered = not checks.assumed(lambda frequency: (frequency != 0).any(), reference_frequency)
    return PID(
        model=model,
        filter=None if unfiltered else ReferenceFilter(reference_frequency),
        proportional=proportional,
        integral=integral,
        derivative=derivative,
        actuator_rate=0.15 / sampling_time if actuator_rate is None else actuator_rate,
        direction=direction,
        feedforward=feedforward,
        motor=motor,
    )
