"""
Single and double precision
===========================

The same run in float64 and in float32. Single precision is what microcontrollers and graphics processors prefer.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.plants.two_link_arm()
law = ut.rcaf(plant.model(outer_mass=1.0), preset="paper")  # kg of 2
sine = ut.references.sine(amplitude=[1.0, 1.0], frequency=[1.0, 2.0])  # rad, rad/s
runs = {
    precision: ut.simulate(plant, law, sine, duration=10.0, precision=precision) for precision in ("float64", "float32")
}

# %%
# The difference does not grow, because a stable loop forgets rounding errors.

position = {name: run.dataset["position"].values for name, run in runs.items()}
difference = np.abs(position["float32"] - position["float64"]).max(axis=1)
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.semilogy(runs["float64"].dataset["time"][1:], 1e6 * difference[1:])
axes.set(xlabel="time, s", ylabel="largest difference of both angles, µrad")
plt.show()

# %%
error = max(runs["float64"].metrics["steady"]["error_rms_axes"])
late = difference[len(difference) // 2 :].max()
print(f"Second half: difference of at most {1e6 * late:.2g} µrad, tracking error of {1e6 * error:.2g} µrad rms")
