"""
Voltage limits
==============

Suite U1 demands more than motors at 24 V can give. The paper's law, with bounded weights and a composite gain that the
motors bear, does not know the limit. This example runs it on three supplies.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

goal = ut.references.setpoint([1, 1, 1, 0, 0, 0.5])  # m, rad
runs = {}
for supply in (24.0, 48.0, 96.0):  # V
    plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3(fidelity="shaft", supply=supply))
    law = ut.rcaf(plant.model(), preset="paper", composite=20.0, weights_bound=20.0)
    runs[supply] = ut.simulate(plant, law, goal, disturbance=ut.disturbances.u1(), duration=10.0)

# %%
# Above: the error. Below: the largest of the eight voltages.

figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
for supply, run in runs.items():
    axes[0].plot(run.dataset["time"], np.linalg.norm(run.dataset["error"][:, :3], axis=1), label=f"{supply:g} V")
    axes[1].plot(run.dataset["time"], np.abs(run.dataset["input"]).max("actuator"), label=f"{supply:g} V")
axes[0].set(ylabel="position error, m")
axes[0].legend(title="supply")
axes[1].set(xlabel="time, s", ylabel="largest voltage, V")
plt.show()

# %%
for supply, run in runs.items():
    steady = run.metrics["steady"]
    print(
        f"{supply:g} V: {steady['position_rms']:.2g} m rms per axis, "
        f"inputs at their limit {steady['saturated_fraction']:.0%} of the time"
    )
