"""
Four fidelity levels of one thruster
====================================

The thruster of the paper's Table 3 can be simulated at four levels of detail: ``ideal`` (thrust proportional to
voltage), ``static`` (quasi-static motor), ``shaft`` (the propeller speed is a state) and ``electromechanical`` (speed
and winding current are states). The controller, RCAFC with the gains of Table 1, is the same on all of them.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

goal = ut.references.setpoint([2, 3, 4, np.pi / 3, np.pi / 4, 2 * np.pi / 5])  # m, rad
runs = {}
for level in ("ideal", "static", "shaft", "electromechanical"):
    plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3(fidelity=level))
    law = ut.rcaf(plant.model(speed_sensor=level == "ideal"), preset="paper")
    runs[level] = ut.simulate(plant, law, goal, disturbance=ut.disturbances.u1())

# %%
# The full motor model adds a lag that the design does not know. The run ends there, soon after it has begun.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for level, run in runs.items():
    lived = run.dataset.sel(time=slice(0, run.dataset.attrs["ended"]))
    axes.semilogy(lived["time"], np.linalg.norm(lived["error"][:, :3], axis=1), label=level)
axes.set(xlabel="time, s", ylabel="distance from the set-point, m")
axes.legend()
plt.show()

# %%
# A run that fails raises nothing. Its status says what happened and when.

for level, run in runs.items():
    print(f"{level}: {run.status.word} at {run.dataset.attrs['ended']:.3g} s")
