"""One vehicle in MuJoCo's engine, with water around it."""

# pyright: reportAttributeAccessIssue=false
# MuJoCo's bindings are compiled and come without stubs.

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.core import checks
from undertow.core.status import Status
from undertow.outside.mujoco_engine import frames
from undertow.outside.mujoco_engine.hydrodynamics import Hydrodynamics, UniformFlow
from undertow.outside.mujoco_engine.mjcf import mjcf
from undertow.physics.vehicles.vehicle import VehicleModel

_ENVELOPE = 1e3  # m, m/s, rad/s; far beyond any vehicle

Thrusts = Callable[[float], NDArray]


class Submerged:
    """A vehicle as MuJoCo moves it: `model` and `data` are MuJoCo's own, for whatever else one does with them.

    Added mass reacts to the acceleration that is being computed, which the engine has no place for. At each stage of
    its integrator (M + M_A) a = f + f_water is solved with the engine's own M and f, and -M_A a applied as a force;
    the engine's own solution is then the same a. The engine calls back for this through `mjcb_control`, of which a
    process has one: no other simulation with such a callback may run at the same time.

    Args:
        vehicle: any with a possible inertia.
        timestep: of the engine, s.
        added_mass: `force` (any), or `body`, a weightless second body inside the engine (what a rigid body could have).
        water: how the water moves.

    Raises:
        BadInput: the vehicle is no rigid body, its added mass no body, a wrong word, timestep not positive, water that
            does not have three finite numbers.
    """

    def __init__(
        self, vehicle: VehicleModel, timestep: float = 2e-3, added_mass: str = "force", water: UniformFlow | None = None
    ):
        checks.choice("added_mass", added_mass, ("force", "body"))
        held = added_mass == "body"
        self.model = mujoco.MjModel.from_xml_string(mjcf(vehicle, timestep, held))
        self.data = mujoco.MjData(self.model)
        self._hydrodynamics = Hydrodynamics(vehicle, held)
        self._water = UniformFlow() if water is None else water
        for name, rate in self._water._asdict().items():
            checks.length(name, rate, 3, "north, east, down")
            checks.finite(name, rate)

    def place(self, position: ArrayLike, nu: ArrayLike) -> None:
        """Put it somewhere, at time 0.

        Args:
            position: north, east, down (m), roll, pitch, yaw (rad).
            nu: body velocity over ground, m/s and rad/s.
        """
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = frames.joint_position(position)
        self.data.qvel[:] = np.linalg.solve(frames.velocity_map(self.rotation()), np.asarray(nu, dtype=float))

    def rotation(self) -> NDArray:
        """Body -> world, north, east, down."""
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, self.data.qpos[3:])
        return frames.flip_tensor(matrix.reshape(3, 3))

    def nu(self) -> NDArray:
        """Body velocity over ground, m/s and rad/s."""
        return frames.velocity_map(self.rotation()) @ self.data.qvel

    def position(self) -> NDArray:
        """North, east, down (m), roll, pitch, yaw (rad)."""
        return np.concatenate([frames.flip(self.data.qpos[:3]), frames.euler_angles(self.rotation())])

    def velocity(self) -> NDArray:
        """Rates of `position`, m/s and rad/s."""
        return frames.output_rates(self.rotation(), self.nu())

    def acceleration(self, thrust: ArrayLike) -> NDArray:
        """nu_dot, m/s^2 and rad/s^2, at a thrust per thruster, N."""
        with self._pushed(lambda t: np.asarray(thrust, dtype=float)):
            mujoco.mj_forward(self.model, self.data)
        return frames.velocity_map(self.rotation()) @ self.data.qacc - _turning(self.nu())

    def advance(self, thrusts: Thrusts, steps: int) -> None:
        """Move on, as far as the state means anything.

        Args:
            thrusts: thrust per thruster, N, at a time in s.
            steps: of the engine.
        """
        with self._pushed(thrusts):
            for _ in range(steps):
                if self.status() != Status.OK:
                    break
                mujoco.mj_step(self.model, self.data)

    def status(self) -> Status:
        """Whether the state means anything; every warning of the engine is a failure."""
        state = np.concatenate([self.data.qpos, self.data.qvel])
        if any(warning.number for warning in self.data.warning) or not np.isfinite(state).all():
            return Status.NOT_FINITE
        return Status.DIVERGED if np.abs(state).max() > _ENVELOPE else Status.OK

    @contextmanager
    def _pushed(self, thrusts: Thrusts) -> Iterator[None]:
        """The engine asks for forces at each stage of its integrator."""
        before = mujoco.get_mjcb_control()
        mujoco.set_mjcb_control(lambda model, data: self._push(thrusts(data.time)))
        try:
            yield
        finally:
            mujoco.set_mjcb_control(before)

    def _push(self, thrust: NDArray) -> None:
        """Thrust through the engine's own sites; added mass and damping as generalised forces.

        Nothing is called here that could make the engine complain: inside a callback MuJoCo 4.0.0 then hangs.
        """
        data = self.data
        added_mass = self._hydrodynamics.added_mass
        data.ctrl[:] = thrust
        mass_matrix, levers = np.empty((6, 6)), np.empty((self.model.nu, 6))
        mujoco.mj_fullM(self.model, data, mass_matrix)
        mujoco.mju_sparse2dense(
            levers, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        force = data.qfrc_passive - data.qfrc_bias + levers.T @ thrust
        rotation = self.rotation()
        to_body = frames.velocity_map(rotation)
        nu = to_body @ data.qvel
        water = self._hydrodynamics.wrench(rotation, nu, self._water) + added_mass @ _turning(nu)
        qacc = np.linalg.solve(mass_matrix + to_body.T @ added_mass @ to_body, force + to_body.T @ water)
        data.qfrc_applied[:] = to_body.T @ (water - added_mass @ to_body @ qacc)


def _turning(nu: NDArray) -> NDArray:
    """What the velocity of the origin loses in body axes because they turn: nu_dot = T qacc - this, m/s^2."""
    return np.concatenate([frames.cross(nu[3:], nu[:3]), np.zeros(3)])
