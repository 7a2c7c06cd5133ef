"""x_ddot = F x + H x_dot + G u with any matrix G: square, redundant, under-actuated or of deficient rank."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import AbstractDynamics, Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec, pseudo_inverse
from undertow.core.param import Param, param
from undertow.physics.plants.mechanism import AbstractOutputMechanism, MechanismState, both_ways, nominal


class LinearSystem(eqx.Module):
    """The three matrices.

    Raises:
        BadInput: shapes that do not match, or entries that are not finite.
    """

    gain: Float[Param, "n m"] = param("m/s^2", "acceleration per input", symbol="G")
    position_term: Float[Param, "n n"] = param("1/s^2", "acceleration per position", symbol="F")
    velocity_term: Float[Param, "n n"] = param("1/s", "acceleration per velocity", symbol="H")

    def __check_init__(self):
        if np.ndim(self.gain) != 2 or not np.size(self.gain):
            raise BadInput("gain", "be a matrix with a row per output", f"of shape {np.shape(self.gain)}")
        n = self.gain.shape[0]
        for name in ("gain", "position_term", "velocity_term"):
            value = getattr(self, name)
            checks.finite(name, value)
            if name != "gain" and value.shape != (n, n):
                raise BadInput(name, f"be {n} x {n}, as `gain` has {n} rows", f"of shape {value.shape}")

    def drift(self, position, velocity):
        """F x + H x_dot, m/s^2."""
        return matvec(self.position_term, position) + matvec(self.velocity_term, velocity)


class LinearDynamics(AbstractDynamics):
    """Dynamics with nominal matrices; G# is the Moore-Penrose inverse for any rank."""

    system: LinearSystem
    allocation: Float[Array, "m n"]  # G+; constant, so nothing is factorised in the loop

    def drift(self, y: Measurement):
        return self.system.drift(y.position, y.velocity)

    def gain(self, y: Measurement):
        return self.system.gain

    def invert(self, y: Measurement, acceleration):
        return matvec(self.allocation, acceleration)


class LinearPlant(AbstractOutputMechanism):
    """Coupled axes with inputs without unit; directions outside the range of G stay in open loop."""

    system: LinearSystem
    limit: Float[Param, ""] = param("1", "largest input")
    outputs: tuple[str, ...] = eqx.field(static=True)
    output_units: tuple[str, ...] = eqx.field(static=True)
    input_unit: str = eqx.field(static=True, default="1")

    def __check_init__(self):
        checks.not_negative("limit", self.limit, finite=False)

    def acceleration(self, t, x: MechanismState, u, d: Load):
        own = self.system.drift(x.position, x.velocity) + matvec(self.system.gain, u)
        return own + d.acceleration - d.wrench

    def limits(self):
        return both_ways(self.limit, self.system.gain.shape[1])

    def power(self, x: MechanismState, u):
        """Power given to unit masses: u_j times the velocity along column j of G."""
        return u * matvec(self.system.gain.T, x.velocity)

    def model(self, *, gain=None, position_term=None, velocity_term=None) -> Model:
        """Nominal model for the controller; parameters that are not given have their true values.

        Args:
            gain: G, as many rows and columns as the true one.
            position_term: F, 1/s^2.
            velocity_term: H, 1/s.

        Raises:
            BadInput: a shape differs from the true one.
        """
        system = nominal(self.system, gain=gain, position_term=position_term, velocity_term=velocity_term)
        if system.gain.shape != self.system.gain.shape:
            raise BadInput("gain", f"have shape {self.system.gain.shape}, as the plant has", f"{system.gain.shape}")
        coordinates = OutputCoordinates(angles=(False,) * len(self.outputs))
        dynamics = LinearDynamics(system, pseudo_inverse(system.gain))
        return Model(dynamics, coordinates, DirectActuator(1.0, *self.limits()))


def linear_plant(
    gain=((1.0, 0.0, 0.5), (0.0, 1.0, 0.5)), position_term=None, velocity_term=None, limit: float = float("inf")
) -> LinearPlant:
    """x_ddot = F x + H x_dot + G u: the number of outputs and inputs is that of the rows and columns of G.

    Args:
        gain: G, one row per output, m/s^2 per unit of input.
        position_term: F, 1/s^2, negative for a restoring term; None for zero.
        velocity_term: H, 1/s, negative for damping; None for zero.
        limit: largest |u|.
    """
    n = len(gain) if np.ndim(gain) else 0
    none = jnp.zeros((n, n))
    system = LinearSystem(
        gain, none if position_term is None else position_term, none if velocity_term is None else velocity_term
    )
    names = tuple(f"x{i + 1}" for i in range(n))
    return LinearPlant(system=system, limit=limit, outputs=names, output_units=("m",) * n)
