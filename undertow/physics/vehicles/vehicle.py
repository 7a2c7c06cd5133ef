"""A vehicle as data: published numbers with their sources, and derived matrices."""

import dataclasses
import importlib

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.arrays import as_array, library_of, quotient
from undertow.core.errors import BadInput
from undertow.core.kept_programs import kept_program
from undertow.core.numerics.linear_algebra import inverse
from undertow.core.param import Param, Sources, param, sources_field
from undertow.core.runtime import double_outside_runs
from undertow.physics.vehicles.body import Body, rigid_body_mass
from undertow.physics.vehicles.thruster_labels import check_own, labels


class VehicleModel(eqx.Module):
    """Hull and thruster layout. Body axes forward, starboard, down; matrices positive.

    Raises:
        BadInput: a value is not finite or of the wrong sign or size, the mass matrix is not symmetric positive
            definite, or names of thrusters cannot be shown or are not one per thruster.
    """

    name: str = eqx.field(static=True)
    mass: Float[Param, ""] = param("kg", "dry mass", symbol="m")
    weight: Float[Param, ""] = param("N", "weight in air", symbol="W")
    buoyancy: Float[Param, ""] = param("N", "buoyancy, fully submerged", symbol="B")
    r_g: Float[Param, "3"] = param("m", "centre of gravity", symbol="r_g")
    r_b: Float[Param, "3"] = param("m", "centre of buoyancy", symbol="r_b")
    inertia: Float[Param, "3 3"] = param("kg m^2", "inertia about the body origin", symbol="I_o")
    added_mass: Float[Param, "6 6"] = param("kg, kg m, kg m^2", "added mass, positive", symbol="M_A")
    linear_damping: Float[Param, "6 6"] = param("N s/m, N s, N m s", "linear damping, positive", symbol="D_l")
    quadratic_damping: Float[Param, "6 6"] = param(
        "N s^2/m^2, N s^2, N m s^2", "quadratic damping, positive", symbol="D_q"
    )
    thruster_positions: Float[Param, "N 3"] = param("m", "position of each thruster", symbol="r_j")
    thruster_directions: Float[Param, "N 3"] = param("", "unit vector of positive thrust", symbol="e_j")
    sources: Sources = sources_field()
    size: Float[Param, "3"] | None = param("m", "length, width, height", default=None)
    own_thruster_names: tuple[str, ...] = eqx.field(static=True, default=())  # () for none; "" for a thruster without

    @double_outside_runs
    def __check_init__(self):
        for name in ("r_g", "r_b"):
            checks.length(name, getattr(self, name), 3, "forward, starboard, down")
            checks.finite(name, getattr(self, name), "m")
        if self.size is not None:
            checks.length("size", self.size, 3, "length, width, height")
            checks.positive("size", self.size, "m")
        checks.positive("mass", self.mass, "kg")
        checks.positive("weight", self.weight, "N")
        checks.positive("buoyancy", self.buoyancy, "N")
        self._check_thrusters()
        for name, size in (("inertia", 3), ("added_mass", 6), ("linear_damping", 6), ("quadratic_damping", 6)):
            shape = np.shape(getattr(self, name))
            if shape != (size, size):
                raise BadInput(name, f"be a {size} x {size} matrix", f"of shape {shape}")
            checks.finite(name, getattr(self, name))
        self._check_mass_matrix()

    def _check_mass_matrix(self) -> None:
        """Check M; the error names the added mass, or the inertia where that is at fault."""
        whole = self.mass_matrix()
        if isinstance(whole, Tracer):
            checks.positive_definite("added_mass", whole)
            return
        rigid = np.asarray(whole) - np.asarray(self.added_mass)
        definite = np.abs(rigid - rigid.T).max() <= 1e-9 * np.abs(rigid).max() and np.linalg.eigvalsh(rigid).min() > 0
        name, hint = "inertia", "That of the rigid body, M_RB, is not by itself"
        if definite:
            name, hint = "added_mass", "With mass and inertia alone it would be: check the signs of the added mass"
        checks.positive_definite(name, whole, whole="M = M_RB + M_A", hint=hint)

    def _check_thrusters(self) -> None:
        shapes = np.shape(self.thruster_positions), np.shape(self.thruster_directions)
        if shapes[0] != shapes[1] or len(shapes[0]) != 2 or shapes[0][1] != 3 or shapes[0][0] == 0:
            raise BadInput(
                "thruster_positions", "have one row (x, y, z) per thruster, like thruster_directions", shapes
            )
        if len(self.own_thruster_names) not in (0, self.thrusters):
            must = f"be {self.thrusters} names, one per thruster, or none"
            raise BadInput("own_thruster_names", must, f"{len(self.own_thruster_names)}")
        check_own(self.own_thruster_names, lambda j: f"own_thruster_names[{j}]")
        checks.finite("thruster_positions", self.thruster_positions, "m")
        if checks.known(self.thruster_directions):
            norms = np.linalg.norm(np.asarray(self.thruster_directions), axis=1)
            for j in np.flatnonzero(~(np.abs(norms - 1) < 1e-6)):
                raise BadInput(f"thruster_directions[{j}]", "have length 1", f"{norms[j]:.6g} long")

    def _repr_html_(self) -> str:
        """What a notebook shows: what its numbers mean, and a picture of its thrusters."""
        # Pages stand above the physics, which imports none of them: a notebook that asks loads them.
        return importlib.import_module("undertow.report.vehicle_view").vehicle_in_notebook(self)

    @property
    def thrusters(self) -> int:
        """Number N of thrusters."""
        return self.thruster_positions.shape[0]

    def thruster_names(self) -> tuple[str, ...]:
        """T1, T2, ... each with its own name, or with what the pose tells: `T5 vertical bow port`.

        That one pushes along z, ahead of the origin, to port. One that pushes along y is `lateral`.
        """
        return labels(self.thruster_positions, self.thruster_directions, self.own_thruster_names)

    @double_outside_runs
    def mass_matrix(self) -> Float[Array, "6 6"]:
        """M = M_RB + M_A."""
        rigid = rigid_body_mass(self.mass, self.r_g, self.inertia)
        return as_array(library_of(rigid, self.added_mass).add(rigid, self.added_mass))

    @double_outside_runs
    def thruster_matrix(self) -> Float[Array, "6 N"]:
        """B of Eq. (6) from the thruster poses: column j is (e_j, r_j x e_j)."""
        return _columns(self.thruster_positions, self.thruster_directions)

    @double_outside_runs
    def body(self) -> Body:
        """Coefficients of the equation of motion."""
        mass_matrix = self.mass_matrix()
        return Body(
            mass_matrix=mass_matrix,
            inverse_mass_matrix=inverse(mass_matrix),
            linear_damping=self.linear_damping,
            quadratic_damping=self.quadratic_damping,
            weight=self.weight,
            buoyancy=self.buoyancy,
            r_g=self.r_g,
            r_b=self.r_b,
            gravity=quotient(self.weight, self.mass),
        )

    @double_outside_runs
    def with_thrusters(self, numbers) -> "VehicleModel":
        """The same hull with some of its thrusters only, numbered from 1.

        Raises:
            BadInput: a number that is not one of the vehicle's thrusters, a repeated one, or none.
        """
        for number in numbers:
            if number not in range(1, self.thrusters + 1):
                raise BadInput("thrusters", f"be numbers from 1 to {self.thrusters}", number)
        if len(set(numbers)) != len(numbers) or not len(numbers):
            raise BadInput("thrusters", "name one or more different thrusters", list(numbers))
        places = [int(number) - 1 for number in numbers]
        index = jnp.asarray(places)
        return dataclasses.replace(
            self,
            thruster_positions=self.thruster_positions[index],
            thruster_directions=self.thruster_directions[index],
            own_thruster_names=tuple(self.own_thruster_names[place] for place in places if self.own_thruster_names),
        )


@kept_program
def _columns(positions: Float[Array, "N 3"], directions: Float[Array, "N 3"]) -> Float[Array, "6 N"]:
    return jnp.concatenate([directions, jnp.cross(positions, directions)], axis=1).T
