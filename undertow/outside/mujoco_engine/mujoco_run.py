"""A sampled closed loop of an undertow controller and a vehicle in MuJoCo."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.core import checks
from undertow.core.contracts import AbstractController, AbstractReference, Measurement, starting_at
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.runtime import double_outside_runs
from undertow.core.status import Status
from undertow.outside.mujoco_engine.submerged import Submerged
from undertow.physics.thrusters.fidelity_levels import ShaftThruster
from undertow.physics.thrusters.motor_thruster import StaticThruster
from undertow.physics.thrusters.thruster import AbstractThruster, PropellerReport


class Propellers:
    """N equal propellers on DC motors without inductance; `speed` (rad/s) is their state.

    Args:
        thruster: on fidelity `shaft` (rotor inertia) or `static` (always in the steady state).
        count: N.

    Raises:
        BadInput: another kind of thruster.
    """

    def __init__(self, thruster: AbstractThruster, count: int):
        if not isinstance(thruster, ShaftThruster | StaticThruster):
            hint = "Others are not written a second time; take fidelity: shaft"
            raise BadInput("thruster", "be on fidelity `shaft` or `static`", type(thruster).__name__, hint=hint)
        self._motor = motor = jax.tree.map(np.asarray, thruster.motor)  # its numbers; its equations are written anew
        self._thrust_coefficients = motor.thrust_coefficient, motor.reverse_thrust_coefficient
        self._torque_coefficients = motor.torque_coefficient, motor.reverse_torque_coefficient
        self._supply, self._dead_zone = float(thruster.supply), float(thruster.dead_zone)
        self._lost = self._dead_zone if thruster.dead_zone_kind == "subtract" else 0.0
        self._turns_at_once = isinstance(thruster, StaticThruster)
        self.speed = np.zeros(count)

    def admissible(self, voltage: NDArray) -> NDArray:
        """Voltage within the supply, V."""
        return np.clip(voltage, -self._supply, self._supply)

    def thrust(self) -> NDArray:
        """T = c_t speed|speed|, N."""
        return _either(self.speed, self._thrust_coefficients) * self.speed * np.abs(self.speed)

    def turn(self, voltage: NDArray, dt: float, samples: int) -> NDArray:
        """Hold a voltage (V) for dt (s).

        Returns:
            Thrust (N) at the ends of `samples` equal parts of dt, shape (samples + 1, N).
        """
        outside = voltage - self._lost * np.sign(voltage)
        terminal = np.where(np.abs(voltage) <= self._dead_zone, 0.0, outside)
        if self._turns_at_once:
            self.speed = self._steady(terminal)
            return np.tile(self.thrust(), (samples + 1, 1))
        thrusts = [self.thrust()]
        for _ in range(samples):
            self.speed = self._stepped(terminal, dt / samples)
            thrusts.append(self.thrust())
        return np.array(thrusts)

    def _speed_rate(self, voltage: NDArray, speed: NDArray) -> NDArray:
        """J speed_dot = k_t I - k_f speed - Q with R I = V - k_e speed."""
        motor = self._motor
        current = (voltage - motor.back_emf_constant * speed) / motor.resistance
        load = _either(speed, self._torque_coefficients) * speed * np.abs(speed)
        return (motor.torque_constant * current - motor.friction * speed - load) / motor.rotor_inertia

    def _stepped(self, voltage: NDArray, h: float) -> NDArray:
        """Speed one classical Runge-Kutta step later."""
        a = self._speed_rate(voltage, self.speed)
        b = self._speed_rate(voltage, self.speed + h / 2 * a)
        c = self._speed_rate(voltage, self.speed + h / 2 * b)
        d = self._speed_rate(voltage, self.speed + h * c)
        return self.speed + h / 6 * (a + 2 * b + 2 * c + d)

    def _steady(self, voltage: NDArray) -> NDArray:
        """Speed at which torque and load balance: positive root of q x^2 + l x = k_t |V| / R, with the sign of V."""
        motor = self._motor
        quadratic = _either(voltage, self._torque_coefficients)
        linear = motor.friction + motor.torque_constant * motor.back_emf_constant / motor.resistance
        drive = motor.torque_constant * np.abs(voltage) / motor.resistance
        return np.sign(voltage) * (np.sqrt(linear**2 + 4 * quadratic * drive) - linear) / (2 * quadratic)


def _either(direction: NDArray, coefficients: tuple[NDArray, NDArray]) -> NDArray:
    """The forward or the reverse coefficient."""
    return np.where(direction < 0, coefficients[1], coefficients[0])


class MujocoRun(NamedTuple):
    """What happened, at each sampling time of the controller; rows as in an undertow dataset."""

    time: NDArray  # s, shape (K,)
    position: NDArray  # m, rad, shape (K, 6)
    velocity: NDArray  # m/s, rad/s, shape (K, 6)
    target: NDArray  # m, rad, shape (K, 6)
    voltage: NDArray  # applied, V, shape (K, N)
    status: Status  # of the end; series end with the last valid state


@double_outside_runs
def run_in_mujoco(
    body: Submerged,
    thruster: AbstractThruster,
    controller: AbstractController,
    reference: AbstractReference,
    *,
    duration: float = 20.0,
    dt: float = 1e-2,
    position: ArrayLike | None = None,
) -> MujocoRun:
    """Run a sampled closed loop with MuJoCo as the plant: command, move with the volts held, then adapt.

    Args:
        body: the vehicle in MuJoCo.
        thruster: on fidelity `shaft` or `static`.
        controller: any, made from the model of an undertow plant.
        reference: what to follow.
        duration: s, rounded to whole sampling times.
        dt: sampling time of the controller, s; a whole number of the engine's steps.
        position: north, east, down (m), roll, pitch, yaw (rad) at t = 0, at rest; None for zero.

    Returns:
        MujocoRun. One that fails says so in its status; nothing is raised.

    Raises:
        BadInput: times that do not go together, or another kind of thruster.
    """
    checks.positive("duration", duration, "s")
    checks.positive("dt", dt, "s")
    timestep = body.model.opt.timestep
    per_step = round(dt / timestep)
    if per_step < 1 or abs(per_step * timestep - dt) > 1e-9 * dt:
        raise BadInput("dt", f"be a whole number of the engine's steps ({timestep:g} s)", f"{dt:g} s")
    propellers = Propellers(thruster, body.model.nu)
    start = np.zeros(6) if position is None else np.asarray(position, dtype=float)
    body.place(start, np.zeros(6))
    reference = starting_at(reference, jnp.asarray(start))
    command, advance, desired = map(eqx.filter_jit, (controller.command, controller.advance, reference.at))  # pyright: ignore[reportArgumentType] - overloads of filter_jit
    z = None
    rows = []
    control_steps = round(duration / dt)
    status = Status.OK
    for step in range(control_steps + 1):
        t = step * dt
        y = _measured(body, propellers)
        r = desired(jnp.asarray(t))
        z = controller.init(y, r) if z is None else z
        volts, _ = command(z, y, r)
        applied = propellers.admissible(np.asarray(volts))
        status = body.status() if np.isfinite(volts).all() else Status.COMMAND_NOT_FINITE
        if status != Status.OK:
            break
        rows.append((t, body.position(), body.velocity(), np.asarray(r.position), applied))
        if step < control_steps:
            thrusts = propellers.turn(applied, dt, 2 * per_step)
            # Runge-Kutta asks at the ends and in the middle of each step.
            body.advance(lambda now, t=t, thrusts=thrusts: thrusts[round(2 * (now - t) / timestep)], per_step)
            z = advance(z, y, r, jnp.asarray(applied), jnp.asarray(dt))
    return MujocoRun(*map(np.array, zip(*rows, strict=True)), status=status)


def _measured(body: Submerged, propellers: Propellers) -> Measurement:
    turning = PropellerReport(jnp.asarray(propellers.speed), None)
    return measurement_of_outputs(jnp.asarray(body.position()), jnp.asarray(body.velocity()), turning)
