"""
A Monte Carlo study in Python
=============================

Twenty runs of one axis under random disturbances, and the empirical distribution function (ECDF) of their error, for
two natural frequencies of the controller. Both see the same seeds. For thousands of runs, ``undertow campaign``
compiles them as a batch and resumes after interruptions.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.plants.double_integrator(axes=1)
disturbance = ut.disturbances.random_suite(axes=1, span=10.0)
hold = ut.references.setpoint([0.0])

errors = {}
for frequency in (2.0, 4.0):  # rad/s
    law = ut.controllers.pid(plant.model(), frequency=frequency)
    runs = [
        ut.simulate(plant, law, hold, disturbance=disturbance, duration=10.0, dt=0.01, record=0.1, seed=seed)
        for seed in range(20)
    ]
    errors[frequency] = np.array([1e3 * run.metrics["steady"]["position_rms"] for run in runs])

# %%
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
for frequency, found in errors.items():
    axes.ecdf(found, label=f"{frequency:g} rad/s")
axes.set(xlabel="position error, mm rms", ylabel="share of the runs at or below")
axes.legend(title="natural frequency")
plt.show()

# %%
# The same seeds, so the two are compared run by run.

for frequency, found in errors.items():
    median, most = np.quantile(found, [0.5, 0.9])
    print(f"{frequency:g} rad/s: median {median:.0f} mm, nine of ten runs below {most:.0f} mm")
print(f"The faster loop is better in {(errors[4.0] < errors[2.0]).mean():.0%} of the runs")
