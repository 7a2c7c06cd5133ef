"""MuJoCo: `rollout` of a pendulum by an engine of rigid bodies with joints and contacts.

The sampled law would need a command between any two samples, for which `rollout` has no hook, so it is not compared.
"""

import mujoco
import numpy as np
import rows
from mujoco import rollout
from pendulum import ANGLES, DURATION, RUNS, STIFFNESS

# A point mass at 1 m from the joint. A body needs an inertia; 1e-12 kg m^2 lies below every error asked for.
MODEL = f"""
<mujoco><option integrator="RK4" timestep="{{}}" gravity="0 0 -{STIFFNESS}"><flag contact="disable"/></option>
<worldbody><body><joint type="hinge" axis="0 1 0"/>
<inertial mass="1" pos="0 0 -1" diaginertia="1e-12 1e-12 1e-12"/></body></worldbody></mujoco>"""


def of_steps(steps):
    model = mujoco.MjModel.from_xml_string(MODEL.format(repr(DURATION / steps)))
    data, start = mujoco.MjData(model), np.stack([np.zeros(RUNS), ANGLES, np.zeros(RUNS)], axis=1)
    return lambda: rollout.rollout(model, data, start, nstep=steps)[0][:, -1, 1].copy()


rows.print_cheapest("alone", "MuJoCo, rollout, RK4", rows.STEPS, of_steps)
