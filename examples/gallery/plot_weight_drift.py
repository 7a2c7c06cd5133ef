"""
Drift of the fuzzy weights under noise
======================================

Noise on the measured velocity trains the weights of the fuzzy system as if it were an error. Without a bound they move
apart for as long as the run lasts. A weight bound stops the drift.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.plants.double_integrator(axes=1)
noise = ut.navigation.white_noise(velocity=0.01)  # m/s
hold = ut.references.setpoint([0.0])

runs = {}
for name, bound in {"without a bound": np.inf, "weights bounded by 5 m/s²": 5.0}.items():
    law = ut.rcaf(plant.model(), preset="paper", weights_bound=bound)
    runs[name] = ut.simulate(plant, law, hold, navigation=noise, duration=60.0, record=0.1)

# %%
# The vehicle has nothing to do in this run: there is no disturbance, and it starts at its reference.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for name, run in runs.items():
    axes.plot(run.dataset["time"], run.dataset["weights_peak"], label=name)
axes.set(xlabel="time, s", ylabel="largest weight, m/s²")
axes.legend()
plt.show()

# %%
for name, run in runs.items():
    print(f"{name}: largest weight {float(run.dataset['weights_peak'].max()):.3g} m/s² within 60 s")
