"""One axis pushed by motors: 187.5 kg on a rail, four thrusters side by side; the setting of section 3.9."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp

from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import AbstractController, AbstractDynamics, Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.status import Status
from undertow.physics.plants.mechanism import AbstractMechanism, both_ways
from undertow.physics.thrusters.thruster import AbstractThruster

MASS, COUNT = 187.5, 4  # kg
_ENVELOPE = 100.0  # m, m/s


class RailState(NamedTuple):
    position: Any
    velocity: Any
    thrusters: Any


class RailDynamics(AbstractDynamics):
    """F = 0, or what the speed sensors explain; G from the voltage gain."""

    thruster: AbstractThruster
    speed_sensor: bool = eqx.field(static=True, default=False)

    def drift(self, y):
        if not self.speed_sensor:
            return jnp.zeros(1)
        return jnp.broadcast_to(self.thruster.speed_term(y.actuator), (COUNT,)).sum()[None] / MASS

    def gain(self, y):
        return jnp.full((1, COUNT), self.thruster.voltage_gain() / MASS)

    def invert(self, y, acceleration):
        return jnp.broadcast_to(acceleration * MASS / COUNT / self.thruster.voltage_gain(), (COUNT,))


class MotorRail(AbstractMechanism):
    """x_ddot = sum of thrusts / mass + d."""

    thruster: AbstractThruster
    outputs: tuple[str, ...] = eqx.field(static=True, default=("x1",))
    output_units: tuple[str, ...] = eqx.field(static=True, default=("m",))
    input_unit: str = eqx.field(static=True, default="V")

    def initial_state(self, position=None, velocity=None):
        zero = jnp.zeros(1)
        start = (zero if value is None else value for value in (position, velocity))
        return RailState(*start, self.thruster.initial_state(COUNT))

    def dynamics(self, t, x, u, d: Load):
        return RailState(x.velocity, self.acceleration(t, x, u, d), self.thruster.dynamics(x.thrusters, u))

    def output(self, t, x):
        return Measurement(x.position, x.velocity, self.thruster.report(x.thrusters))

    def acceleration(self, t, x, u, d: Load):
        return self.thruster.thrust(x.thrusters, u).sum()[None] / MASS + d.acceleration

    def limits(self):
        return both_ways(self.thruster.supply, COUNT)

    def power(self, x, u):
        return jnp.zeros(COUNT)

    def status(self, x):
        far = (jnp.abs(x.position) > _ENVELOPE).any() | (jnp.abs(x.velocity) > _ENVELOPE).any()
        return jnp.where(far, int(Status.DIVERGED), int(Status.OK))

    def model(self, *, speed_sensor: bool = False):
        return Model(RailDynamics(self.thruster, speed_sensor), OutputCoordinates((False,)), DirectActuator())


class ThrustDynamics(AbstractDynamics):
    """The same axis with thrusts for inputs."""

    def drift(self, y):
        return jnp.zeros(1)

    def gain(self, y):
        return jnp.full((1, COUNT), 1 / MASS)

    def invert(self, y, acceleration):
        return jnp.broadcast_to(acceleration * MASS / COUNT, (COUNT,))


def thrust_model():
    """The same axis with thrusts for inputs."""
    return Model(ThrustDynamics(), OutputCoordinates((False,)), DirectActuator())


class InnerLoop(AbstractController):
    """A law that asks for thrusts, over a loop on measured propeller speeds by computed voltage, lambda in 1/s.

    V = k_2 Om + k_3 Q + k_1 lambda (Om_wanted - Om); the law hears which thrusts there are. Section X9.
    """

    model: Model
    law: AbstractController
    thruster: Any
    rate: float

    def init(self, y, r):
        return self.law.init(y, r)

    def command(self, z, y, r):
        thrust, signals = self.law.command(z, y, r)
        motor, speed = self.thruster.motor, y.actuator.speed
        wanted = motor.speed_at(thrust)
        return motor.steady_voltage(speed) + motor.k1 * self.rate * (wanted - speed), signals

    def signals(self):
        return self.law.signals()

    def advance(self, z, y, r, u_applied, dt):
        return self.law.advance(z, y, r, self.thruster.motor.thrust(y.actuator.speed), dt)
