"""
Divergence on the full motor model
==================================

RCAFC with the gains of Table 1 diverges on the full motor model of Table 3. The winding causes this: this example runs
the same loop with smaller and smaller inductances.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

goal = ut.references.setpoint([2, 3, 4, np.pi / 3, np.pi / 4, 2 * np.pi / 5])  # m, rad
runs = {}
for inductance in (0.01, 0.003, 0.001):  # H; Table 3 prints 0.01
    thruster = ut.thrusters.paper_table3(inductance=inductance)
    plant = ut.HybridVehicle(ut.vehicles.odin(), thruster)
    runs[inductance] = ut.simulate(
        plant, ut.rcaf(plant.model(), preset="paper"), goal, disturbance=ut.disturbances.u1(), duration=5.0
    )

# %%
# The largest voltage of the eight thrusters. Without a supply limit, a diverging loop demands an ever larger voltage.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for inductance, run in runs.items():
    lived = run.dataset.sel(time=slice(0, run.dataset.attrs["ended"]))
    largest = np.abs(lived["input"]).max("actuator")
    axes.semilogy(lived["time"], np.maximum(largest, 0.1), label=f"{1e3 * inductance:g} mH")
axes.set(xlabel="time, s", ylabel="largest voltage, V")
axes.legend(title="inductance")
plt.show()

# %%
for inductance, run in runs.items():
    print(f"{1e3 * inductance:g} mH: {run.status.word} at {run.dataset.attrs['ended']:.3g} s")
