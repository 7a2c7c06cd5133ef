"""Inverted pendulum on a cart: the standard plant of adaptive fuzzy control, n = m = 1."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import AbstractDynamics, Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.param import Param, param
from undertow.core.status import Status
from undertow.physics.plants.mechanism import AbstractMechanism, both_ways, given_or_zero, nominal

_FLAT = 0.01  # rad short of 90 deg, where the force has nearly no effect: G is 1 % of its upright value

_WANG = "Wang 1993, as in the codes that go with Liu's textbooks"


class CartPole(AbstractDynamics):
    """Cart and uniform pole: angle_ddot = f + b u, with the motion of the cart eliminated. Wang 1993.

    Raises:
        BadInput: a constant is not positive.
    """

    cart_mass: Float[Param, ""] = param("kg", "mass of the cart", symbol="m_c", source=_WANG)
    pole_mass: Float[Param, ""] = param("kg", "mass of the pole", symbol="m", source=_WANG)
    half_length: Float[Param, ""] = param("m", "half the length of the pole", symbol="l", source=_WANG)
    gravity: Float[Param, ""] = param("m/s^2", "gravity", symbol="g", source=_WANG)

    def __check_init__(self):
        for name in ("cart_mass", "pole_mass", "half_length", "gravity"):
            checks.positive(name, getattr(self, name))

    def inertia(self, angle):
        """Torque on the pole per angular acceleration with a free cart, kg m^2."""
        share = self.pole_mass / (self.cart_mass + self.pole_mass)
        return self.pole_mass * self.half_length**2 * (4 / 3 - share * jnp.cos(angle) ** 2)

    def lever(self, angle):
        """b, angular acceleration per force, 1/(kg m)."""
        arm = self.pole_mass * self.half_length * jnp.cos(angle)
        return arm / (self.cart_mass + self.pole_mass) / self.inertia(angle)

    def drift(self, y: Measurement):
        """f, rad/s^2: weight, less the effect of the pole's swing on the cart."""
        angle = y.position
        weight = self.pole_mass * self.gravity * self.half_length * jnp.sin(angle) / self.inertia(angle)
        return weight - self.lever(angle) * self.swing(angle, y.velocity)

    def gain(self, y: Measurement):
        return self.lever(y.position)[:, None]

    def invert(self, y: Measurement, acceleration):
        return acceleration / self.lever(y.position)

    def swing(self, angle, rate):
        """Horizontal force of the swinging pole on the cart, N."""
        return self.pole_mass * self.half_length * rate**2 * jnp.sin(angle)

    def cart_acceleration(self, angle, rate, angle_acceleration, force):
        """m/s^2, along the force."""
        lift = self.pole_mass * self.half_length * jnp.cos(angle) * angle_acceleration
        return (force - self.swing(angle, rate) + lift) / (self.cart_mass + self.pole_mass)


class PendulumState(NamedTuple):
    """Angle from upright (rad), its rate (rad/s), and the speed of the cart (m/s), which is not controlled."""

    angle: Float[Array, "1"]
    rate: Float[Array, "1"]
    cart_speed: Float[Array, "1"]


class InvertedPendulum(AbstractMechanism):
    """Angle of a pole on a cart; a positive force on the cart turns the pole towards positive angles."""

    cart_pole: CartPole
    limit: Float[Param, ""] = param("N", "largest force")
    outputs: tuple[str, ...] = eqx.field(static=True, default=("angle",))
    output_units: tuple[str, ...] = eqx.field(static=True, default=("rad",))
    input_unit: str = eqx.field(static=True, default="N")

    def initial_state(self, position=None, velocity=None) -> PendulumState:
        return PendulumState(given_or_zero(position, 1), given_or_zero(velocity, 1), jnp.zeros(1))

    def dynamics(self, t, x: PendulumState, u, d: Load) -> PendulumState:
        turning = self.acceleration(t, x, u, d)
        return PendulumState(x.rate, turning, self.cart_pole.cart_acceleration(x.angle, x.rate, turning, u))

    def output(self, t, x: PendulumState) -> Measurement:
        return Measurement(x.angle, x.rate)

    def acceleration(self, t, x: PendulumState, u, d: Load):
        own = self.cart_pole.drift(Measurement(x.angle, x.rate)) + self.cart_pole.lever(x.angle) * u
        return own + d.acceleration - d.wrench / self.cart_pole.inertia(x.angle)

    def limits(self):
        return both_ways(self.limit, 1)

    def power(self, x: PendulumState, u):
        return u * x.cart_speed

    def status(self, x: PendulumState) -> Array:
        flat = (jnp.abs(x.angle) > jnp.pi / 2 - _FLAT).any()
        return jnp.where(flat, int(Status.OUT_OF_RANGE), int(Status.OK))

    def model(
        self, *, cart_mass: float | None = None, pole_mass: float | None = None, half_length: float | None = None
    ) -> Model:
        """Nominal model for the controller; parameters that are not given have their true values.

        Args:
            cart_mass: kg.
            pole_mass: kg.
            half_length: half the length of the pole, m.
        """
        cart_pole = nominal(self.cart_pole, cart_mass=cart_mass, pole_mass=pole_mass, half_length=half_length)
        return Model(cart_pole, OutputCoordinates(angles=(True,)), DirectActuator(1.0, *self.limits()))


def inverted_pendulum(
    cart_mass: float = 1.0,
    pole_mass: float = 0.1,
    half_length: float = 0.5,
    gravity: float = 9.8,
    limit: float = float("inf"),
) -> InvertedPendulum:
    """Pole on a cart, angle 0 upright, driven by a force. Defaults are Wang's; a run ends when the pole lies flat.

    Args:
        cart_mass: kg.
        pole_mass: kg.
        half_length: half the length of the pole, m.
        gravity: m/s^2.
        limit: largest |force|, N.
    """
    return InvertedPendulum(cart_pole=CartPole(cart_mass, pole_mass, half_length, gravity), limit=limit)
