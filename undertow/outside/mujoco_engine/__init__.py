"""Independent physics: an undertow vehicle as a body in MuJoCo's C engine, under an undertow controller.

What is MuJoCo's own: the rigid body (mass matrix, Coriolis and centripetal forces), weight, buoyancy, thruster
geometry, kinematics, integration. What it has not, added mass and damping, is computed here in plain NumPy and applied
as a force. Nothing of the plant that it is compared with is called. docs/how-to/independent-physics.md says what
agrees.
"""

import importlib.util

if importlib.util.find_spec("mujoco") is None:
    remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[mujoco]'"
    raise ModuleNotFoundError(f"MuJoCo is not installed. {remedy}", name="mujoco")

from undertow.outside.mujoco_engine.hydrodynamics import UniformFlow as UniformFlow
from undertow.outside.mujoco_engine.mjcf import mjcf as mjcf
from undertow.outside.mujoco_engine.mujoco_run import MujocoRun as MujocoRun
from undertow.outside.mujoco_engine.mujoco_run import run_in_mujoco as run_in_mujoco
from undertow.outside.mujoco_engine.submerged import Submerged as Submerged
