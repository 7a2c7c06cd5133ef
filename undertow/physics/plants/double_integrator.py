"""n independent axes x_ddot = u + d: the simplest plant, on which the theory of the law is exact."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import AbstractDynamics, Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.param import Param, param
from undertow.physics.plants.mechanism import AbstractOutputMechanism, MechanismState, both_ways


class UnitMasses(AbstractDynamics):
    """F = 0, G = I."""

    def drift(self, y: Measurement):
        return jnp.zeros_like(y.position)

    def gain(self, y: Measurement):
        return jnp.eye(y.position.shape[0])

    def invert(self, y: Measurement, acceleration):
        return acceleration


class DoubleIntegrator(AbstractOutputMechanism):
    """Unit masses on independent axes; inputs are accelerations, optionally limited to +-limit m/s^2."""

    limit: Float[Param, ""] = param("m/s^2", "largest input")
    outputs: tuple[str, ...] = eqx.field(static=True)
    output_units: tuple[str, ...] = eqx.field(static=True)
    input_unit: str = eqx.field(static=True, default="m/s^2")

    def __check_init__(self):
        checks.not_negative("limit", self.limit, finite=False)

    def acceleration(self, t, x: MechanismState, u, d: Load):
        return u + d.acceleration - d.wrench

    def limits(self):
        return both_ways(self.limit, len(self.outputs))

    def power(self, x: MechanismState, u):
        return u * x.velocity

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
