"""A hull that is partly out of the water: what its dry share takes from the forces on the submerged one.

The displaced volume is spread evenly over an ellipsoid about the centre of buoyancy, of which a level surface cuts off
a share in closed form. With x = (depth of the centre) / (half the height of the ellipsoid along the vertical), limited
to -1 and 1, the share

    s = (2 + 3 x - x^3) / 4

is under water: a smooth function that is 1 from x = 1 on. Buoyancy, damping and added mass are s times those of the
submerged body. Buoyancy acts at the centre of the submerged part, so that it is conservative; added mass that changes
with depth exerts the force that conserves kinetic energy (Lagrange). The thrust of a thruster fades with the depth of
its own place over the same height; its motor does not feel that. Slopes of waves, spray, and air in the stream of a
propeller are left out.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.arrays import as_array, library_of
from undertow.core.contracts import FreeSurface, ModelScaling
from undertow.core.numerics.linear_algebra import inverse_symmetric, matvec
from undertow.core.numerics.rotations import cross
from undertow.physics.vehicles.body import Body, SeenFromWater, coriolis_force
from undertow.physics.vehicles.vehicle import VehicleModel

Vector3 = Float[Array, "3"]
Vector6 = Float[Array, "6"]
Matrix6 = Float[Array, "6 6"]

FRESH_WATER = 1000.0  # kg/m^3
_GRID = 2.0**-44  # m, a twentieth of a picometre
_SPHERE = 3 / (4 * np.pi * FRESH_WATER)  # m^3/kg, cube of the radius of a sphere of water over its mass


def half_size(vehicle: VehicleModel) -> Float[Array, "3"]:
    """Semi-axes of the ellipsoid, m: half of the vehicle's `size`, or the radius of a sphere of its displaced volume.

    The volume is that of fresh water. The radius is rounded a little, so that it has the same bits where many
    vehicles are built together.
    """
    if vehicle.size is not None:
        return as_array(vehicle.size) / 2
    library = library_of(vehicle.buoyancy, vehicle.mass, vehicle.weight)
    buoyancy, mass, weight = map(library.asarray, (vehicle.buoyancy, vehicle.mass, vehicle.weight))
    displaced = buoyancy * mass / weight  # kg
    radius = library.round(library.cbrt(displaced * _SPHERE) / _GRID) * _GRID
    return as_array(library.broadcast_to(radius, (3,)))


def dry_share(x: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """1 - s at x, the share of an ellipsoid that is out of the water."""
    limited = jnp.clip(x, -1.0, 1.0)
    return (1 - limited) ** 2 * (2 + limited) / 4


class Cut(NamedTuple):
    """A hull as the surface cuts it. What it adds to the submerged body is zero where all of it is under water."""

    submerged: Body
    added_mass: Matrix6  # of the submerged body
    down: Vector3  # third row of R
    x: Float[Array, ""]  # depth of the centre of buoyancy over half the height, -1 to 1
    dry: Float[Array, ""]  # share of the hull that is out of the water
    half_height: Float[Array, ""]  # of the ellipsoid, along the vertical, m
    deepest: Vector3  # its deepest point from its centre, m, body axes
    dry_thrusters: Float[Array, " N"]  # share of the thrust that each thruster loses

    def lost_thrust(self, thrust: Float[Array, " N"]) -> Float[Array, " N"]:
        """What is to be added to the thrust, N."""
        return -self.dry_thrusters * thrust

    def wrench(self, seen: SeenFromWater) -> Vector6:
        """What is to be added to the forces on the submerged body, N and N m.

        Args:
            seen: motion relative to the water; the surface is taken to move with it.
        """
        body, x, dry, deepest = self.submerged, self.x, self.dry, self.deepest
        rim = 1 - x**2
        lever = dry * body.r_b - 3 / 16 * rim**2 * deepest  # centre of the buoyancy that is lost, times its share
        buoyancy = body.buoyancy * jnp.concatenate([dry * seen.down, cross(lever, seen.down)])
        resistance = body.damping(seen.nu) + coriolis_force(self.added_mass, seen.nu)
        slope = 3 * rim / (4 * self.half_height)  # ds / d depth, 1/m
        gradient = slope * jnp.concatenate([self.down, cross(body.r_b - x * deepest, self.down)])
        momentum = matvec(self.added_mass, seen.nu)
        changing = (seen.nu * momentum).sum() / 2 * gradient - (gradient * seen.nu).sum() * momentum
        return buoyancy + dry * resistance + changing

    def body(self) -> Body:
        """The body with the inverse of its present mass matrix."""
        present = inverse_symmetric(self.submerged.mass_matrix - self.dry * self.added_mass)
        inverse = jnp.where(self.dry > 0, present, self.submerged.inverse_mass_matrix)
        return eqx.tree_at(lambda b: b.inverse_mass_matrix, self.submerged, inverse)


class HullEllipsoid(eqx.Module):
    """The ellipsoid of a vehicle, and what else of it the surface changes."""

    half_size: Vector3  # m
    added_mass: Matrix6
    thruster_positions: Float[Array, "N 3"]  # m

    def cut(
        self, surface: FreeSurface, position: Vector3, down: Vector3, body: Body, scaling: ModelScaling | None = None
    ) -> Cut:
        """How the surface cuts the hull.

        Args:
            surface: of the water.
            position: of the body origin, m, world axes.
            down: third row of R.
            body: submerged, with what it carries.
            scaling: of that body; None for none.
        """
        added_mass = self.added_mass if scaling is None else scaling.mass * self.added_mass
        square = self.half_size**2 * down
        half_height = jnp.sqrt((square * down).sum())
        depth = position[2] + surface.depth + surface.elevation
        x = jnp.clip((depth + (body.r_b * down).sum()) / half_height, -1.0, 1.0)
        dry_thrusters = dry_share((depth + matvec(self.thruster_positions, down)) / half_height)
        return Cut(body, added_mass, down, x, dry_share(x), half_height, square / half_height, dry_thrusters)


def hull_of(vehicle: VehicleModel) -> HullEllipsoid:
    """The hull of a vehicle."""
    return HullEllipsoid(half_size(vehicle), vehicle.added_mass, vehicle.thruster_positions)
