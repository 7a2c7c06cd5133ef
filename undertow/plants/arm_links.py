"""Rigid links of a planar arm with two joints: what both the arm and a controller's model of it are made of."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.contracts import AbstractDynamics, Measurement
from undertow.core.param import param
from undertow.numerics.linear_algebra import matvec

_BOOK = "Slotine and Li 1991, Example 9.1"


class Links(AbstractDynamics):
    """Rigid links: mass matrix, Coriolis matrix, weight and energy. Slotine and Li 1991, section 9.1.

    The outer link carries its load: its centre of mass need not lie on the line through its joint.

    Raises:
        BadInput: a mass, length or inertia is not positive, or the offset or gravity is not finite.
    """

    inner_mass: Float[Array, ""] = param("kg", "mass of the inner link", symbol="m_1", source=_BOOK)
    inner_length: Float[Array, ""] = param("m", "joint to joint", symbol="l_1", source=_BOOK)
    inner_centre: Float[Array, ""] = param("m", "shoulder to centre of mass", symbol="l_c1", source=_BOOK)
    inner_inertia: Float[Array, ""] = param("kg m^2", "about its centre of mass", symbol="I_1", source=_BOOK)
    outer_mass: Float[Array, ""] = param("kg", "mass of outer link and load", symbol="m_e", source=_BOOK)
    outer_centre: Float[Array, ""] = param("m", "elbow to their centre of mass", symbol="l_ce", source=_BOOK)
    outer_inertia: Float[Array, ""] = param("kg m^2", "about their centre of mass", symbol="I_e", source=_BOOK)
    outer_offset: Float[Array, ""] = param("rad", "by how far it lags behind the link", symbol="delta_e", source=_BOOK)
    gravity: Float[Array, ""] = param("m/s^2", "gravity in the plane of motion; 0 for a horizontal arm", symbol="g")

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
        """C(q, q_dot), N m s, the choice that makes M_dot - 2 C skew."""
        h = self._coupling() * jnp.sin(q[1] - self.outer_offset)
        return jnp.array([[-h * rate[1], -h * (rate[0] + rate[1])], [h * rate[0], 0.0]])

    def weight(self, q: Float[Array, "2"]) -> Float[Array, "2"]:
        """g(q), N m; angles from the horizontal."""
        outer = self.outer_mass * self.outer_centre * jnp.cos(q[0] + q[1] - self.outer_offset)
        inner = (self.inner_mass * self.inner_centre + self.outer_mass * self.inner_length) * jnp.cos(q[0])
        return self.gravity * jnp.stack([inner + outer, outer])

    def energy(self, q: Float[Array, "2"], rate: Float[Array, "2"]) -> Float[Array, ""]:
        """Kinetic and potential energy, J."""
        outer = self.outer_mass * self.outer_centre * jnp.sin(q[0] + q[1] - self.outer_offset)
        inner = (self.inner_mass * self.inner_centre + self.outer_mass * self.inner_length) * jnp.sin(q[0])
        return rate @ matvec(self.mass_matrix(q), rate) / 2 + self.gravity * (inner + outer)

    def drift(self, y: Measurement) -> Float[Array, "2"]:
        """-M^-1 (C q_dot + g), rad/s^2."""
        own = matvec(self.coriolis_matrix(y.position, y.velocity), y.velocity) + self.weight(y.position)
        return -matvec(self.inverse_mass_matrix(y.position), own)

    def gain(self, y: Measurement) -> Float[Array, "2 2"]:
        return self.inverse_mass_matrix(y.position)

    def invert(self, y: Measurement, acceleration: Float[Array, "2"]) -> Float[Array, "2"]:
        return matvec(self.mass_matrix(y.position), acceleration)
