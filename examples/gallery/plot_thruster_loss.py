"""
Loss of a thruster
==================

A BlueROV2 Heavy keeps its station in a current when one of its eight thrusters loses part of its thrust, or all of it.
The controller is not informed: for it, the lost thrust is a load like any other.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200())
law = ut.controllers.pid(plant.model(), sampling_time=0.01)
hold = ut.references.setpoint([0.0] * 6)
current = ut.disturbances.current([0.3, 0.2, 0.0])  # m/s

runs = {}
for remaining in (1.0, 0.5, 0.0):
    loss = {"target": "thruster 1", "mode": "fraction", "severity": remaining, "onset": 10.0}  # s
    runs[remaining] = ut.simulate(plant, law, hold, disturbance=current, faults=[loss], dt=0.01, record=0.05)

# %%
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for remaining, run in runs.items():
    error = 1e3 * np.linalg.norm(run.dataset["error"][:, :3], axis=1)
    axes.plot(run.dataset["time"], error, label=f"{remaining:.0%}")
    after = float(error[run.dataset["time"].values >= 10.0].max())
    print(f"{remaining:.0%} of the thrust remains: at most {after:.1f} mm from the station afterwards")
axes.set(xlabel="time, s", ylabel="position error, mm")
axes.legend(title="thrust of thruster 1 after 10 s")
plt.show()
