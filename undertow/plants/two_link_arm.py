"""Planar arm with two revolute joints: M(q) q_ddot + C q_dot + g = torque, n = m = 2."""

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.param import param
from undertow.core.status import Status
from undertow.numerics.linear_algebra import matvec
from undertow.plants.arm_links import Links
from undertow.plants.mechanism import AbstractMechanism, both_ways, given_or_zero
from undertow.plants.nominal_parameters import nominal

_ENVELOPE = 1e3  # rad, rad/s


class ArmState(NamedTuple):
    """Joint angles (rad) and their rates (rad/s)."""

    angle: Float[Array, "2"]
    rate: Float[Array, "2"]


class TwoLinkArm(AbstractMechanism):
    """Shoulder and elbow, turned by torques; the elbow is measured from the inner link."""

    links: Links
    limit: Float[Array, ""] = param("N m", "largest torque")
    outputs: tuple[str, ...] = eqx.field(static=True, default=("shoulder", "elbow"))
    output_units: tuple[str, ...] = eqx.field(static=True, default=("rad", "rad"))
    input_unit: str = eqx.field(static=True, default="N m")

    def initial_state(self, position=None, velocity=None) -> ArmState:
        return ArmState(given_or_zero(position, 2), given_or_zero(velocity, 2))

    def dynamics(self, t, x: ArmState, u, d: Load) -> ArmState:
        return ArmState(x.rate, self.acceleration(t, x, u, d))

    def output(self, t, x: ArmState) -> Measurement:
        return Measurement(x.angle, x.rate)

    def acceleration(self, t, x: ArmState, u, d: Load):
        turned = matvec(self.links.inverse_mass_matrix(x.angle), u - d.wrench)
        return self.links.drift(self.output(t, x)) + turned + d.acceleration

    def limits(self):
        return both_ways(self.limit, 2)

    def power(self, x: ArmState, u):
        return u * x.rate

    def status(self, x: ArmState) -> Array:
        far = (jnp.abs(x.angle) > _ENVELOPE).any() | (jnp.abs(x.rate) > _ENVELOPE).any()
        return jnp.where(far, int(Status.DIVERGED), int(Status.OK))

    def model(
        self, *, outer_mass: float | None = None, outer_centre: float | None = None, outer_offset: float | None = None
    ) -> Model:
        """What a controller is told of this plant; what is not given is the truth.

        Args:
            outer_mass: of outer link and load, kg.
            outer_centre: from the elbow to their centre of mass, m.
            outer_offset: by how far that centre lags behind the link, rad.
        """
        told = nominal(self.links, outer_mass=outer_mass, outer_centre=outer_centre, outer_offset=outer_offset)
        return Model(told, OutputCoordinates(angles=(True, True)), DirectActuator(1.0, *self.limits()))


def two_link_arm(
    inner_mass: float = 1.0,
    inner_length: float = 1.0,
    inner_centre: float = 0.5,
    inner_inertia: float = 0.12,
    outer_mass: float = 2.0,
    outer_centre: float = 0.6,
    outer_inertia: float = 0.25,
    outer_offset: float = math.pi / 6,
    gravity: float = 9.81,
    limit: float = math.inf,
) -> TwoLinkArm:
    """Planar arm with two joints, angles from the horizontal, torques in. Defaults are those of Slotine and Li 1991.

    Args:
        inner_mass: kg.
        inner_length: joint to joint, m.
        inner_centre: shoulder to the inner link's centre of mass, m.
        inner_inertia: about that centre, kg m^2.
        outer_mass: outer link with its load, kg.
        outer_centre: elbow to their centre of mass, m.
        outer_inertia: about that centre, kg m^2.
        outer_offset: angle by which that centre lags behind the outer link, rad.
        gravity: in the plane of motion, m/s^2; 0 for a horizontal arm, as in the book.
        limit: largest |torque|, N m.
    """
    inner = (inner_mass, inner_length, inner_centre, inner_inertia)
    outer = (outer_mass, outer_centre, outer_inertia, outer_offset)
    return TwoLinkArm(links=Links(*inner, *outer, gravity), limit=limit)
