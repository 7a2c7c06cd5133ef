"""Planar arm with two revolute joints: M(q) q_ddot + C q_dot + g = torque, n = m = 2."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param
from undertow.core.parametric_dynamics import AbstractParametricDynamics, Parametrization
from undertow.physics.plants.mechanism import AbstractOutputMechanism, MechanismState, both_ways, nominal

_BOOK = "Slotine and Li 1991, Example 9.1"


class Links(AbstractParametricDynamics):
    """Rigid links: mass matrix, Coriolis matrix and weight. Slotine and Li 1991, section 9.1.

    Its parameters are a_1 to a_4 of the book, kg m^2, and the first moment of what the shoulder carries, kg m.

    The outer link carries a load: its centre of mass need not lie on the line through its joint.

    Raises:
        BadInput: a mass, length or inertia is not positive, or the offset or gravity is not finite.
    """

    inner_mass: Float[Param, ""] = param("kg", "mass of the inner link", symbol="m_1", source=_BOOK)
    inner_length: Float[Param, ""] = param("m", "joint to joint", symbol="l_1", source=_BOOK)
    inner_centre: Float[Param, ""] = param("m", "shoulder to centre of mass", symbol="l_c1", source=_BOOK)
    inner_inertia: Float[Param, ""] = param("kg m^2", "about its centre of mass", symbol="I_1", source=_BOOK)
    outer_mass: Float[Param, ""] = param("kg", "mass of outer link and load", symbol="m_e", source=_BOOK)
    outer_centre: Float[Param, ""] = param("m", "elbow to their centre of mass", symbol="l_ce", source=_BOOK)
    outer_inertia: Float[Param, ""] = param("kg m^2", "about their centre of mass", symbol="I_e", source=_BOOK)
    outer_offset: Float[Param, ""] = param("rad", "its lag behind the link", symbol="delta_e", source=_BOOK)
    gravity: Float[Param, ""] = param("m/s^2", "gravity in the plane of motion; 0 for a horizontal arm", symbol="g")

    def __check_init__(self):
        for name in ("inner", "outer"):
            for what in ("mass", "centre", "inertia"):
                checks.positive(f"{name}_{what}", getattr(self, f"{name}_{what}"))
        checks.positive("inner_length", self.inner_length)
        checks.finite("outer_offset", self.outer_offset)
        checks.finite("gravity", self.gravity)

    def _coupling(self) -> Float[Array, ""]:
        return self.outer_mass * self.inner_length * self.outer_centre

    def mass_matrix(self, q: Float[Array, "2"]) -> Float[Array, "2 2"]:
        """M(q), kg m^2: symmetric, positive definite."""
        coupling = self._coupling() * jnp.cos(q[1] - self.outer_offset)
        outer = self.outer_inertia + self.outer_mass * self.outer_centre**2
        inner = self.inner_inertia + self.inner_mass * self.inner_centre**2 + self.outer_mass * self.inner_length**2
        return jnp.array([[inner + outer + 2 * coupling, outer + coupling], [outer + coupling, outer]])

    def inverse_mass_matrix(self, q: Float[Array, "2"]) -> Float[Array, "2 2"]:
        """M(q)^-1, 1/(kg m^2)."""
        (a, b), (_, c) = self.mass_matrix(q)
        return jnp.array([[c, -b], [-b, a]]) / (a * c - b * b)

    def coriolis_matrix(self, q: Float[Array, "2"], rate: Float[Array, "2"]) -> Float[Array, "2 2"]:
        """C(q, q_dot), N m s, chosen so that M_dot - 2 C is skew-symmetric."""
        h = self._coupling() * jnp.sin(q[1] - self.outer_offset)
        return jnp.array([[-h * rate[1], -h * (rate[0] + rate[1])], [h * rate[0], 0.0]])

    def weight(self, q: Float[Array, "2"]) -> Float[Array, "2"]:
        """g(q), N m; angles from the horizontal."""
        outer = self.outer_mass * self.outer_centre * jnp.cos(q[0] + q[1] - self.outer_offset)
        inner = (self.inner_mass * self.inner_centre + self.outer_mass * self.inner_length) * jnp.cos(q[0])
        return self.gravity * jnp.stack([inner + outer, outer])

    def drift(self, y: Measurement) -> Float[Array, "2"]:
        """-M^-1 (C q_dot + g), rad/s^2."""
        own = matvec(self.coriolis_matrix(y.position, y.velocity), y.velocity) + self.weight(y.position)
        return -matvec(self.inverse_mass_matrix(y.position), own)

    def gain(self, y: Measurement) -> Float[Array, "2 2"]:
        return self.inverse_mass_matrix(y.position)

    def invert(self, y: Measurement, acceleration: Float[Array, "2"]) -> Float[Array, "2"]:
        return matvec(self.mass_matrix(y.position), acceleration)

    def parametrization(self) -> Parametrization:
        outer = self.outer_inertia + self.outer_mass * self.outer_centre**2
        inner = self.inner_inertia + self.inner_mass * self.inner_centre**2 + self.outer_mass * self.inner_length**2
        coupling, offset = self._coupling(), self.outer_offset
        moment = self.inner_mass * self.inner_centre + self.outer_mass * self.inner_length
        nominal = jnp.stack([inner + outer, outer, coupling * jnp.cos(offset), coupling * jnp.sin(offset), moment])
        largest = jnp.full(5, 2.0) * nominal[0]
        return Parametrization(nominal, largest, jnp.ones(5), jnp.diagonal(self.mass_matrix(jnp.zeros(2))))

    def generalized_force(self, y: Measurement, parameters, velocity, acceleration) -> Float[Array, "2"]:
        """As in section 9.2 of the book, with the weight of a vertical arm."""
        a1, a2, a3, a4, moment = parameters
        (q1, q2), (rate1, rate2) = y.position, y.velocity
        coupling, h = a3 * jnp.cos(q2) + a4 * jnp.sin(q2), a3 * jnp.sin(q2) - a4 * jnp.cos(q2)
        (v1, v2), (w1, w2) = velocity, acceleration
        outer = self.gravity * (a3 * jnp.cos(q1 + q2) + a4 * jnp.sin(q1 + q2)) / self.inner_length
        first = (a1 + 2 * coupling) * w1 + (a2 + coupling) * w2 - h * rate2 * v1 - h * (rate1 + rate2) * v2
        second = (a2 + coupling) * w1 + a2 * w2 + h * rate1 * v1
        return jnp.stack([first + self.gravity * moment * jnp.cos(q1) + outer, second + outer])

    def accelerated_by(self, y: Measurement, force: Float[Array, "2"]) -> Float[Array, "2"]:
        return matvec(self.inverse_mass_matrix(y.position), force)


class TwoLinkArm(AbstractOutputMechanism):
    """Shoulder and elbow driven by torques; the elbow angle is relative to the inner link."""

    links: Links
    limit: Float[Param, ""] = param("N m", "largest torque")
    outputs: tuple[str, ...] = eqx.field(static=True, default=("shoulder", "elbow"))
    output_units: tuple[str, ...] = eqx.field(static=True, default=("rad", "rad"))
    input_unit: str = eqx.field(static=True, default="N m")
    envelope = 1e3  # rad, rad/s

    def acceleration(self, t, x: MechanismState, u, d: Load):
        turned = matvec(self.links.inverse_mass_matrix(x.position), u - d.wrench)
        return self.links.drift(self.output(t, x)) + turned + d.acceleration

    def limits(self):
        return both_ways(self.limit, 2)

    def power(self, x: MechanismState, u):
        return u * x.velocity

    def model(
        self, *, outer_mass: float | None = None, outer_centre: float | None = None, outer_offset: float | None = None
    ) -> Model:
        """Nominal model for the controller; parameters that are not given have their true values.

        Args:
            outer_mass: of outer link and load, kg.
            outer_centre: from the elbow to their centre of mass, m.
            outer_offset: angle by which that centre lags behind the link, rad.
        """
        links = nominal(self.links, outer_mass=outer_mass, outer_centre=outer_centre, outer_offset=outer_offset)
        return Model(links, OutputCoordinates(angles=(True, True)), DirectActuator(1.0, *self.limits()))


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
    """Planar arm with two joints, angles from the horizontal, driven by torques. Defaults: Slotine and Li 1991.

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
