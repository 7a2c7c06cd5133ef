"""
RCAFC and RAFC at a set-point
=============================

The paper's Example 1: ODIN moves to a set-point while suite U1 disturbs all six axes. The robust composite adaptive
fuzzy controller (RCAFC) learns from tracking and modelling error, the robust adaptive fuzzy controller (RAFC) from the
tracking error alone. Thrust is proportional to voltage here: fidelity level ``ideal``.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3(fidelity="ideal"))
model = plant.model(speed_sensor=True)
goal = ut.references.setpoint([2, 3, 4, np.pi / 3, np.pi / 4, 2 * np.pi / 5])  # m, rad

# %%
# The two laws differ in one gain: without the composite gain, RCAFC is RAFC.

laws = {"RCAFC": ut.rcaf(model, preset="paper"), "RAFC": ut.rcaf(model, preset="paper", composite=0.0)}
runs = {name: ut.simulate(plant, law, goal, disturbance=ut.disturbances.u1()) for name, law in laws.items()}

# %%
# Both approach the set-point at the same rate, that of the feedback gains. What is left then is the part of the
# disturbance that the estimate does not follow.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for name, run in runs.items():
    error = run.dataset["error"][:, :3]
    axes.semilogy(run.dataset["time"], np.linalg.norm(error, axis=1), label=name)
axes.set(xlabel="time, s", ylabel="distance from the set-point, m")
axes.legend()
plt.show()

# %%
# The steady window is the second half of the run.

for name, run in runs.items():
    print(f"{name}: rms position error {1e3 * run.metrics['steady']['position_rms']:.3g} mm per axis")
