"""A thruster with axial flow: thrust overshoots, then falls as the flow builds up."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.actuator_model import AbstractMemorylessActuator
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import safe_sqrt
from undertow.core.param import Param, Sources, param, sources_field
from undertow.physics.thrusters.thruster import AbstractMotorlessThruster, PerThruster

_HALVINGS = 45  # of the interval in which the steady thrust of a voltage is looked for
_LEAST = 1e-12  # N; stands for 0, where the root of a thrust has no slope


class AxialFlowState(NamedTuple):
    """Propeller speeds (rad/s), flow through the propellers and flow of the water around them (m/s)."""

    speed: PerThruster
    flow: PerThruster
    ambient: PerThruster


class AxialFlowThruster(AbstractMotorlessThruster):
    """Propeller speed n, axial flow v and ambient flow v_a: the form of Healey et al. 1995, with linear terms.

        T = c_T n|n| - c_Tv v|n| ,  Q = c_Q n|n| - c_Qv v|n|
        n_dot = -k_n n - k_q Q + k_V (V -+ dead zone)
        v_dot = -k_v v - k_vv (v - v_a)|v| + k_t T ,  v_a_dot = -k_a v_a - k_aa v_a|v_a| + k_ta T

    The ambient flow is caused by the thruster itself, as on a test bench; the speed of the vehicle is neglected.

    Raises:
        BadInput: a value that is not positive (losses, linear terms, dead zones, current: negative).
    """

    thrust_coefficient: Float[Param, ""] = param("N s^2/rad^2", "thrust per speed squared", symbol="c_T")
    thrust_loss: Float[Param, ""] = param("N s^2/(rad m)", "thrust lost per flow and speed", symbol="c_Tv")
    torque_coefficient: Float[Param, ""] = param("N m s^2/rad^2", "torque per speed squared", symbol="c_Q")
    torque_loss: Float[Param, ""] = param("N m s^2/(rad m)", "torque lost per flow and speed", symbol="c_Qv")
    speed_decay: Float[Param, ""] = param("1/s", "back-EMF and friction", symbol="k_n")
    torque_load: Float[Param, ""] = param("rad/(N m s^2)", "deceleration per torque", symbol="k_q")
    forward_drive: Float[Param, ""] = param("rad/(s^2 V)", "acceleration per volt beyond the dead zone", symbol="k_V+")
    reverse_drive: Float[Param, ""] = param("rad/(s^2 V)", "the same in reverse", symbol="k_V-")
    forward_dead_zone: Float[Param, ""] = param("V", "voltage below which the propeller stands still")
    reverse_dead_zone: Float[Param, ""] = param("V", "the same in reverse")
    flow_decay: Float[Param, ""] = param("1/s", "linear loss of flow", symbol="k_v")
    flow_drag: Float[Param, ""] = param("1/m", "quadratic loss of flow", symbol="k_vv")
    flow_drive: Float[Param, ""] = param("1/kg", "acceleration of the flow per thrust", symbol="k_t")
    ambient_decay: Float[Param, ""] = param("1/s", "linear loss of ambient flow", symbol="k_a")
    ambient_drag: Float[Param, ""] = param("1/m", "quadratic loss of ambient flow", symbol="k_aa")
    ambient_drive: Float[Param, ""] = param("1/kg", "acceleration of the ambient flow per thrust", symbol="k_ta")
    current_per_torque: Float[Param, ""] = param("A/(N m)", "current per propeller torque")
    linear_gain: Float[Param, ""] = param("N/V", "gain in the nominal model", symbol="alpha")
    supply: Float[Param, ""] = param("V", "largest drive voltage")
    dead_zone: Float[Param, ""] = param("V", "largest command that the drive ignores", default=0.0)
    sources: Sources = sources_field()

    def __check_init__(self):
        lenient = ("loss", "decay", "dead_zone", "current_per_torque")
        for name in self.__dataclass_fields__:
            if name == "supply":
                checks.positive(name, self.supply, "V", finite=False)
            elif name != "sources":
                (checks.not_negative if name.endswith(lenient) else checks.positive)(name, getattr(self, name))

    def initial_state(self, count) -> AxialFlowState:
        return AxialFlowState(*[jnp.zeros(count)] * 3)

    def dynamics(self, state, voltage) -> AxialFlowState:
        (n, v, ambient), volts = state, self.terminal(voltage)
        driven = self.forward_drive * jnp.maximum(volts - self.forward_dead_zone, 0.0)
        driven = driven - self.reverse_drive * jnp.maximum(-volts - self.reverse_dead_zone, 0.0)
        thrust = self.thrust(state, voltage)
        return AxialFlowState(
            speed=driven - self.speed_decay * n - self.torque_load * self.torque(state),
            flow=self.flow_drive * thrust - self.flow_decay * v - self.flow_drag * (v - ambient) * jnp.abs(v),
            ambient=self.ambient_drive * thrust - (self.ambient_decay + self.ambient_drag * jnp.abs(ambient)) * ambient,
        )

    def thrust(self, state, voltage) -> PerThruster:
        return (self.thrust_coefficient * state.speed - self.thrust_loss * state.flow) * jnp.abs(state.speed)

    def torque(self, state: AxialFlowState) -> PerThruster:
        """Propeller torque Q, N m."""
        return (self.torque_coefficient * state.speed - self.torque_loss * state.flow) * jnp.abs(state.speed)

    def current(self, state, voltage) -> PerThruster:
        return self.current_per_torque * self.torque(state)

    def steady_voltage(self, thrust: PerThruster) -> PerThruster:
        """Command, V, whose steady thrust, after the flow has built up, is a thrust in N: in closed form.

        Ambient flow, flow and speed follow from the thrust, each as the positive root of a quadratic. At zero thrust
        the command is zero, and beside it that of the dead zone.
        """
        sign, size = jnp.sign(thrust), jnp.abs(thrust)
        ambient = _positive_root(self.ambient_drag, self.ambient_decay, self.ambient_drive * size)
        still = self.flow_decay - self.flow_drag * ambient
        flow = _positive_root(self.flow_drag, still, self.flow_drive * size)
        speed = _positive_root(self.thrust_coefficient, -self.thrust_loss * flow, size)
        torque = (self.torque_coefficient * speed - self.torque_loss * flow) * speed
        driven = self.speed_decay * speed + self.torque_load * torque
        forward = driven / self.forward_drive + self.forward_dead_zone
        reverse = driven / self.reverse_drive + self.reverse_dead_zone
        return self.commanded(sign * jnp.where(thrust < 0, reverse, forward))

    def steady_thrust(self, voltage: PerThruster) -> PerThruster:
        """Steady thrust, N, of a command in V: halvings of an interval, and a step of Newton's method.

        Above it is the thrust of the speed without flow, which is largest. The last step has the slope of the curve.
        """
        volts = self.terminal(voltage)
        zone = jnp.where(volts < 0, self.reverse_dead_zone, self.forward_dead_zone)
        drive = jnp.where(volts < 0, self.reverse_drive, self.forward_drive)
        driven = drive * jnp.maximum(jnp.abs(volts) - zone, 0.0)
        fastest = _positive_root(self.torque_load * self.torque_coefficient, self.speed_decay, driven)
        sign = jnp.where(volts < 0, -1.0, 1.0)
        asked = jnp.abs(self.commanded(volts))
        size = lambda thrust: jnp.abs(self.steady_voltage(sign * thrust))

        def halved(_, interval):
            low, high = interval
            middle = (low + high) / 2
            below = size(middle) < asked
            return jnp.where(below, middle, low), jnp.where(below, high, middle)

        start = jnp.zeros_like(driven), 1.1 * self.thrust_coefficient * fastest**2
        low, high = jax.lax.fori_loop(0, _HALVINGS, halved, jax.lax.stop_gradient(start))
        found = jax.lax.stop_gradient(jnp.maximum((low + high) / 2, _LEAST))
        there, slope = jax.jvp(size, (found,), (jnp.ones_like(found),))
        return jnp.where(driven > 0, sign * jnp.maximum(found + (asked - there) / slope, 0.0), 0.0)

    def actuator_model(self, count: int, measured: bool) -> "AxialFlowCurve":
        return AxialFlowCurve(self)

    def speed_term(self, report):
        hint = "A speed sensor does not measure the axial flow, which reduces the thrust by a third at full speed"
        raise BadInput("speed_sensor", "be false with thruster axial_flow", "true", hint=hint)

    def advice(self):
        if float(jnp.max(self.current_per_torque)) > 0:
            return ()
        return ("the current of this thruster is not known: its energy counts as 0. Give `current_per_torque`.",)


class AxialFlowCurve(AbstractMemorylessActuator):
    """Steady thrust of an axial-flow thruster as a controller knows it; its lag is unknown."""

    thruster: AxialFlowThruster

    def time_constant(self) -> None:
        return None

    def range(self, state, rate) -> tuple[PerThruster, PerThruster]:
        supply = jnp.asarray(self.thruster.supply)
        limited = jnp.isfinite(supply)
        volts = jnp.where(limited, supply, 0.0)
        low, high = self.thruster.steady_thrust(-volts), self.thruster.steady_thrust(volts)
        return jnp.where(limited, low, -jnp.inf), jnp.where(limited, high, jnp.inf)

    def force(self, state, u) -> PerThruster:
        return self.thruster.steady_thrust(u)

    def command(self, state, force, rate) -> PerThruster:
        return self.thruster.steady_voltage(force)

    def dead_zone(self):
        return jnp.zeros(())  # `command` is beyond that of the propeller, and the lag smooths what is left


def _positive_root(a: PerThruster, b: PerThruster, c: PerThruster) -> PerThruster:
    """x >= 0 with a x^2 + b x = c, for a > 0 and c >= 0; slope 0 at c = 0 where b is not positive."""
    square = b * b + 4 * a * c
    return (safe_sqrt(square) - b) / (2 * a)


def axial_flow(supply: float = 5.0, current_per_torque: float = 0.0) -> AxialFlowThruster:
    """A small ROV thruster of unknown make, propeller of 0.115 m: the only identified parameter set with axial flow.

    Against its own test bench at +-3 V: speed within 0.7 %, thrust +-11.7 N where 11.7 N and -13.0 N were measured. At
    +-2 V the thrust is 13 and 35 % high; at +-1 V, next to the dead zone, it is half of the measured one. A step to 3 V
    overshoots in thrust by 37 %. Volts are those of the drive's command, full scale about 5 V.

    Args:
        supply: largest command, V.
        current_per_torque: A/(N m), needed for current and energy; 0 where it is unknown, as published.
    """
    return AxialFlowThruster(
        thrust_coefficient=1.46693e-3,
        thrust_loss=0.414627,
        torque_coefficient=2.80421e-6,
        torque_loss=1.2956e-11,
        speed_decay=13.6634,
        torque_load=1856.335,
        forward_drive=737.156,
        reverse_drive=725.469,
        forward_dead_zone=0.86,
        reverse_dead_zone=0.83,
        flow_decay=1.14237,
        flow_drag=63.4361,
        flow_drive=0.0124223,
        ambient_decay=0.239592,
        ambient_drag=1.25832,
        ambient_drive=4.85504e-3,
        current_per_torque=current_per_torque,
        linear_gain=3.9,
        supply=supply,
        sources={
            "*": "NGS ROV-Thruster-Model, thruster_config_2.m",
            "linear_gain": "measured thrust over voltage at 3 V: 11.69 N / 3 V",
            "supply": "approximate full scale of the drive",
            "current_per_torque": "not published",
        },
    )
