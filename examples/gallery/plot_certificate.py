"""
Certificate of a run
====================

The stability proof of the paper has hypotheses. A run records its Lyapunov function and for how long each hypothesis
held, so that one sees how much of the proof applies.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3(fidelity="ideal"))
law = ut.rcaf(plant.model(speed_sensor=True), preset="paper")
goal = ut.references.setpoint([2, 3, 4, np.pi / 3, np.pi / 4, 2 * np.pi / 5])  # m, rad
run = ut.simulate(plant, law, goal, disturbance=ut.disturbances.u1())

# %%
# The Lyapunov function falls while the set-point is approached. It does not fall at every step, because the
# disturbance changes.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.semilogy(run.dataset["time"], run.dataset["lyapunov"])
axes.set(xlabel="time, s", ylabel="Lyapunov function, m²/s²")
plt.show()

# %%
for one in run.certificate["hypotheses"]:
    held = "not recorded" if one["whole"] is None else f"held {one['whole']:.0%} of the time"
    print(f"{one['sentence']}: {held}")
