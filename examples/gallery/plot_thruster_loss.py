"""
Loss of a thruster
==================

A BlueROV2 Heavy keeps its station in a current when one of its eight thrusters stops. The controller is not informed:
the lost thrust is part of the uncertainty that it estimates.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200())
hold = ut.references.setpoint([0.0] * 6)
current = ut.disturbances.current([0.3, 0.2, 0.0])  # m/s
loss = ut.disturbances.thruster_loss(failing=(1,), start=10.0)  # s
laws = {
    "PID": ut.controllers.pid(plant.model(), sampling_time=0.01),
    "robust": ut.rcaf(plant.model(), preset="robust", sampling_time=0.01),
}
runs = {
    name: ut.simulate(plant, law, hold, disturbance=[current, loss], dt=0.01, record=0.05) for name, law in laws.items()
}

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
for name, run in runs.items():
    error = np.linalg.norm(run.dataset["error"][:, :3], axis=1)
    axes[0].plot(run.dataset["time"], 1e3 * error, label=name)
    after = 1e3 * float(error[run.dataset["time"].values >= 10.0].max())
    print(f"{name}: at most {after:.0f} mm from its station after the loss")
axes[0].set(ylabel="position error, mm")
axes[0].legend()
axes[1].plot(runs["robust"].dataset["time"], runs["robust"].dataset["input"])
axes[1].set(xlabel="time, s", ylabel="voltages (robust), V")
plt.show()
