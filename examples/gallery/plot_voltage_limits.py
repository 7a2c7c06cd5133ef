"""
Voltage limits
==============

Suite U1 demands more than motors at 24 V can give. A law that does not know the limits loses the vehicle for seconds
after each overload. The robust variant knows them and recovers at once.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

thruster = ut.thrusters.paper_table3(fidelity="shaft", supply=24.0)  # V
plant = ut.HybridVehicle(ut.vehicles.odin(), thruster)
goal = ut.references.setpoint([1, 1, 1, 0, 0, 0.5])  # m, rad
laws = {
    "RCAFC, weights bounded": ut.rcaf(plant.model(), composite=20.0, weights_bound=20.0),
    "robust variant": ut.rcaf(plant.model(), preset="robust"),
}
runs = {name: ut.simulate(plant, law, goal, disturbance=ut.disturbances.u1()) for name, law in laws.items()}

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
for name, run in runs.items():
    axes[0].plot(run.dataset["time"], np.linalg.norm(run.dataset["error"][:, :3], axis=1), label=name)
    axes[1].plot(run.dataset["time"], np.abs(run.dataset["input"]).max("actuator"), label=name)
axes[0].set(ylabel="position error, m")
axes[0].legend()
axes[1].set(xlabel="time, s", ylabel="largest voltage, V")
plt.show()

# %%
for name, run in runs.items():
    steady = run.metrics["steady"]
    print(f"{name}: {steady['position_rms']:.3g} m rms, at a limit {steady['saturated_fraction']:.0%} of the time")
