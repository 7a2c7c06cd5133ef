"""n independent axes x_ddot = u + d: the simplest plant, on which the theory of the law is exact."""

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
from undertow.plants.mechanism import AbstractMechanism, both_ways, given_or_zero

_ENVELOPE = 1e6


class AxisState(NamedTuple):
    """Positions (m) and velocities (m/s)."""

    position: Float[Array, " n"]
    velocity: Float[Array, " n"]


class UnitMasses(AbstractDynamics):
    """F = 0, G = I."""

    def drift(self, y: Measurement):
        return jnp.zeros_like(y.position)

    def gain(self, y: Measurement):
        return jnp.eye(y.position.shape[0])

    def invert(self, y: Measurement, acceleration):
        return acceleration


class DoubleIntegrator(AbstractMechanism):
    """Unit masses on independent axes; inputs are accelerations, optionally limited to +-limit m/s^2."""

    limit: Float[Param, ""] = param("m/s^2", "largest input")
    outputs: tuple[str, ...] = eqx.field(static=True)
    output_units: tuple[str, ...] = eqx.field(static=True)
    input_unit: str = eqx.field(static=True, default="m/s^2")

    def __check_init__(self):
        checks.not_negative("limit", self.limit, finite=False)

    def initial_state(self, position=None, velocity=None) -> AxisState:
        n = len(self.outputs)
        return AxisState(given_or_zero(position, n), given_or_zero(velocity, n))

    def dynamics(self, t, x: AxisState, u, d: Load) -> AxisState:
        return AxisState(x.velocity, self.acceleration(t, x, u, d))

    def output(self, t, x: AxisState) -> Measurement:
        return Measurement(x.position, x.velocity)

    def acceleration(self, t, x: AxisState, u, d: Load):
        return u + d.acceleration - d.wrench

    def limits(self):
        return both_ways(self.limit, len(self.outputs))

    def power(self, x: AxisState, u):
        return u * x.velocity

    def status(self, x: AxisState) -> Array:
        far = (jnp.abs(x.position) > _ENVELOPE).any() | (jnp.abs(x.velocity) > _ENVELOPE).any()
        return jnp.where(far, int(Status.DIVERGED), int(Status.OK))

    def model(self) -> Model:
        """The exact model."""
        coordinates = OutputCoordinates(angles=(False,) * len(self.outputs))
        return Model(UnitMasses(), coordinates, DirectActuator(1.0, *self.limits()))


def double_integrator(axes: int = 1, limit: float = float(jnp.inf)) -> DoubleIntegrator:
    """x_ddot = u + d on a number of independent axes.

    Args:
        axes: number n of axes.
        limit: largest |u|, m/s^2.
    """
    names = tuple(f"x{i + 1}" for i in range(axes))
    return DoubleIntegrator(limit=limit, outputs=names, output_units=("m",) * axes)
