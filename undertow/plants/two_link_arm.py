"""Planar arm with two revolute joints: M(q) q_ddot + C q_dot + g = torque, n = m = 2."""

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import AbstractModel, AbstractPlant, Effort, Load, Measurement
from undertow.core.param import param
from undertow.core.status import Status
from undertow.numerics.linear import matvec
from undertow.plants.arm_links import Links
from undertow.plants.nominal_parameters import nominal

_ENVELOPE = 1e3  # rad, rad/s


class ArmState(NamedTuple):
    """Joint angles (rad) and their rates (rad/s)."""

    angle: Float[Array, "2"]
    rate: Float[Array, "2"]


class TwoLinkArmModel(AbstractModel):
    """F = -M^-1 (C q_dot + g), G = M^-1 of the links that the controller was told of."""

    links: Links
    actuator: DirectActuator
    angles: tuple[bool, ...] = eqx.field(static=True, default=(True, True))

    def actuators(self) -> DirectActuator:
        return self.actuator

    def drift(self, y: Measurement):
        return self.links.drift(y.position, y.velocity)

    def gain(self, y: Measurement):
        return self.links.inverse_mass_matrix(y.position)

    def invert(self, y: Measurement, acceleration):
        return matvec(self.links.mass_matrix(y.position), acceleration)


class TwoLinkArm(AbstractPlant):
    """Shoulder and elbow, turned by torques; the elbow is measured from the inner link."""

    links: Links
    limit: Float[Array, ""] = param("N m", "largest torque")
    outputs: tuple[str, ...] = eqx.field(static=True, default=("shoulder", "elbow"))
    output_units: tuple[str, ...] = eqx.field(static=True, default=("rad", "rad"))
    input_unit: str = eqx.field(static=True, default="N m")

    def initial_state(self, position=None, velocity=None) -> ArmState:
        zero = jnp.zeros(2)
        return ArmState(zero if position is None else position, zero if velocity is None else velocity)

    def dynamics(self, t, x: ArmState, u, d: Load) -> ArmState:
        return ArmState(x.rate, self.acceleration(t, x, u, d))

    def output(self, t, x: ArmState) -> Measurement:
        return Measurement(x.angle, x.rate)

    def acceleration(self, t, x: ArmState, u, d: Load):
        turned = matvec(self.links.inverse_mass_matrix(x.angle), u - d.wrench)
        return self.links.drift(x.angle, x.rate) + turned + d.acceleration

    def pose(self, x: ArmState) -> None:
        return None

    def admissible(self, x: ArmState, u):
        return jnp.clip(u, -self.limit, self.limit)

    def effort(self, x: ArmState, u) -> Effort:
        return Effort(power=u * x.rate, saturated=(jnp.abs(u) >= self.limit).astype(u.dtype))

    def inputs(self) -> int:
        return 2

    def status(self, x: ArmState) -> Array:
        far = (jnp.abs(x.angle) > _ENVELOPE).any() | (jnp.abs(x.rate) > _ENVELOPE).any()
        return jnp.where(far, int(Status.DIVERGED), int(Status.OK))

    def advice(self) -> tuple[str, ...]:
        return ()

    def model(
        self, *, outer_mass: float | None = None, outer_centre: float | None = None, outer_offset: float | None = None
    ) -> TwoLinkArmModel:
        """What a controller is told of this plant; what is not given is the truth.

        Args:
            outer_mass: of outer link and load, kg.
            outer_centre: from the elbow to their centre of mass, m.
            outer_offset: by how far that centre lags behind the link, rad.
        """
        told = nominal(self.links, outer_mass=outer_mass, outer_centre=outer_centre, outer_offset=outer_offset)
        return TwoLinkArmModel(links=told, actuator=DirectActuator(low=-self.limit, high=self.limit))


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
