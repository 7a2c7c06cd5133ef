"""An undertow vehicle as an MJCF model: what MuJoCo's engine can hold by itself.

One free body of the vehicle's mass, centre of gravity and inertia; gravity W / m; buoyancy as the `gravcomp` of a
point mass taken out of the body at the centre of buoyancy; a site and a motor for each thruster.
"""

from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.outside.mujoco_engine.frames import flip, flip_tensor
from undertow.physics.vehicles.vehicle import VehicleModel

_CLOSE = 1e-9  # share of the largest entry by which a matrix may miss a pattern


class RigidBody(NamedTuple):
    """What an engine for rigid bodies knows of one."""

    mass: float  # kg
    centre: NDArray  # m
    inertia: NDArray  # about the centre, kg m^2

    def without(self, mass: float, point: ArrayLike) -> "RigidBody":
        """The rest, after a point mass (kg) at a point (m) has been taken out of it."""
        remaining_mass = self.mass - mass
        position = np.asarray(point, dtype=float)
        centre = (self.mass * self.centre - mass * position) / remaining_mass
        removed = remaining_mass * mass / self.mass * spread(centre - position)
        return RigidBody(remaining_mass, centre, self.inertia - removed)


def spread(r: NDArray) -> NDArray:
    """|r|^2 1 - r r^T: inertia of 1 kg at r."""
    return r @ r * np.eye(3) - np.outer(r, r)


def about_centre(mass: float, centre: ArrayLike, inertia_about_origin: ArrayLike) -> RigidBody:
    """Rigid body from its inertia (kg m^2) about the origin: the parallel-axis theorem, backwards."""
    r = np.asarray(centre, dtype=float)
    return RigidBody(float(mass), r, np.asarray(inertia_about_origin, dtype=float) - float(mass) * spread(r))


def as_rigid_body(mass_matrix: ArrayLike) -> RigidBody | None:
    """The rigid body with a 6 x 6 mass matrix (kg, kg m, kg m^2, about the origin); None where there is none.

    A rigid body has one mass for all directions, one centre, and no principal inertia above the sum of the others.
    Added mass seldom is like that: a plate has nearly all of it across, none along.
    """
    matrix = np.asarray(mass_matrix, dtype=float)
    mass = np.trace(matrix[:3, :3]) / 3
    small = _CLOSE * np.abs(matrix).max()
    if not mass > small:
        return None
    lever = matrix[3:, :3] / mass
    centre = np.array([lever[2, 1], lever[0, 2], lever[1, 0]])
    body = about_centre(mass, centre, matrix[3:, 3:])
    translation = np.abs(matrix[:3, :3] - mass * np.eye(3)).max() <= small
    coupling = np.abs(lever + lever.T).max() * mass <= small
    return body if translation and coupling and is_possible(body.inertia) else None


def is_possible(inertia: NDArray) -> bool:
    """Whether some distribution of mass has this inertia about its centre."""
    low, middle, high = np.linalg.eigvalsh(inertia)
    return bool(low >= -_CLOSE * abs(high) and low + middle >= (1 - _CLOSE) * high)


# Share of the mass that sits at the centre of buoyancy, where the engine can lift it. The whole is exact whatever it
# is; small, so that what is left of a flat body is still a possible one.
_LIFTED = 1e-3


def mjcf(vehicle: VehicleModel, timestep: float = 2e-3, added_mass: bool = False) -> str:
    """MJCF text of a vehicle in water without added mass and damping.

    Auto-reset is off: a state that is not finite stays visible instead of starting the motion anew.

    Args:
        vehicle: any; its axes are turned to forward, port, up.
        timestep: of the engine's Runge-Kutta integrator, s.
        added_mass: whether added mass is put in as a weightless second body, which takes one that a rigid body
            could have.

    Raises:
        BadInput: the inertia, or the added mass where it is asked for, is not a rigid body's; timestep not positive.
    """
    checks.positive("timestep", timestep, "s")
    mass, weight = float(vehicle.mass), float(vehicle.weight)
    body = about_centre(mass, np.asarray(vehicle.r_g), np.asarray(vehicle.inertia))
    lifted = _LIFTED * mass
    hull = body.without(lifted, np.asarray(vehicle.r_b))
    if not is_possible(hull.inertia):
        must = "be that of a rigid body: no principal inertia above the sum of the others"
        raise BadInput("inertia", must, np.linalg.eigvalsh(body.inertia).round(6), hint="undertow check says more")
    lift = float(vehicle.buoyancy) / (weight * _LIFTED)
    bodies = [
        _body("rest", hull),
        _body("buoyancy", RigidBody(lifted, np.asarray(vehicle.r_b), np.zeros((3, 3))), lift),
    ]
    if added_mass:
        bodies.append(_body("added_mass", _as_body(vehicle), 1.0))
    poses = zip(flip(vehicle.thruster_positions), flip(vehicle.thruster_directions), strict=True)
    sites = [
        f'<site name="thruster{j}" pos="{_text(position)}" zaxis="{_text(axis)}" type="cylinder" size="0.04 0.04"/>'
        for j, (position, axis) in enumerate(poses, start=1)
    ]
    motors = [
        f'<motor name="thruster{j}" site="thruster{j}" gear="0 0 1 0 0 0"/>' for j in range(1, vehicle.thrusters + 1)
    ]
    return f"""<mujoco model={quoteattr(vehicle.name)}>
  <compiler angle="radian"/>
  <option timestep="{timestep!r}" integrator="RK4" gravity="0 0 {-weight / mass!r}">
    <flag contact="disable" autoreset="disable"/>
  </option>
  <worldbody>
    <body name="vehicle">
      <freejoint name="hull"/>
      {_lines(bodies)}
      {_lines(sites)}
    </body>
  </worldbody>
  <actuator>
    {_lines(motors, 4)}
  </actuator>
</mujoco>
"""


def _as_body(vehicle: VehicleModel) -> RigidBody:
    body = as_rigid_body(vehicle.added_mass)
    if body is None:
        hint = "Apply it as a force instead"
        raise BadInput("added_mass", "be one that a rigid body could have", np.diag(vehicle.added_mass), hint=hint)
    return body


def _body(name: str, body: RigidBody, lift: float = 0.0) -> str:
    """Part of the vehicle, which water lifts with `lift` times its weight.

    A frame of its own at its centre: an inertial frame within 30 nm of its body's would be taken for the same.
    """
    i = flip_tensor(body.inertia)
    products = [i[0, 1], i[0, 2], i[1, 2]]
    # MuJoCo turns full matrices to principal axes and wants them positive definite; a diagonal stays as it is.
    inertia = (
        f'fullinertia="{_text([*np.diag(i), *products])}"' if any(products) else f'diaginertia="{_text(np.diag(i))}"'
    )
    inertial = f'<inertial pos="0 0 0" mass="{float(body.mass)!r}" {inertia}/>'
    return f'<body name="{name}" pos="{_text(flip(body.centre))}" gravcomp="{lift!r}">{inertial}</body>'


def _text(numbers) -> str:
    """Numbers in full precision."""
    return " ".join(repr(float(number)) for number in numbers)


def _lines(elements: list[str], indent: int = 6) -> str:
    return f"\n{' ' * indent}".join(elements)
