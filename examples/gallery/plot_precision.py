"""
Single and double precision
===========================

The same run in float64 and in float32. Single precision is what microcontrollers and graphics processors prefer.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200())
law = ut.controllers.pid(plant.model(), sampling_time=0.01)
path = ut.references.lissajous()
water = ut.disturbances.current([0.2, 0.1, 0.0])  # m/s
runs = {
    precision: ut.simulate(plant, law, path, disturbance=water, dt=0.01, record=0.05, precision=precision)
    for precision in ("float64", "float32")
}

# %%
# The difference stays small, because a stable loop forgets rounding errors.

position = {name: run.dataset["position"].values[:, :3] for name, run in runs.items()}
difference = np.linalg.norm(position["float32"] - position["float64"], axis=1)
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.semilogy(runs["float64"].dataset["time"][1:], 1e3 * difference[1:])
axes.set(xlabel="time, s", ylabel="difference in position, mm")
plt.show()

# %%
error = runs["float64"].metrics["steady"]["position_rms"]
print(f"Largest difference: {1e6 * difference.max():.2g} µm; tracking error: {1e3 * error:.2g} mm rms per axis")
