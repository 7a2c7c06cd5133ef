"""
A Monte Carlo study in Python
=============================

A hundred runs of one axis under random disturbances, and the empirical distribution function (ECDF) of their error,
for two natural frequencies of the controller. Both see the same seeds. ``undertow compare`` and ``undertow campaign``
do the same from the command line, with pages and requirements.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

scenario = {
    "plant": {"kind": "double_integrator", "axes": 1},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "disturbance": {"kind": "random_suite", "axes": 1, "span": 10.0},
    "loop": {"duration": 10.0, "dt": 0.01, "record": 0.1},
}
laws = {"slow": {"kind": "pid", "frequency": 2.0}, "fast": {"kind": "pid", "frequency": 4.0}}  # rad/s
with warnings.catch_warnings(action="ignore"):  # it warns that neither was tuned, which is intended here
    found = ut.compare(scenario, laws, trials=100)

# %%
# The result is a dataset with the dimensions ``controller`` and ``sample``.

errors = 1e3 * found.dataset["position_rms"]
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
for name in laws:
    axes.ecdf(errors.sel(controller=name), label=name)
axes.set(xlabel="position error, mm rms", ylabel="share of the runs at or below")
axes.legend(title="controller")
plt.show()

# %%
# Both controllers ran with the same seeds, so they are compared run by run.

for name in laws:
    median, most = np.quantile(errors.sel(controller=name), [0.5, 0.9])
    print(f"{name}: median {median:.0f} mm, nine of ten runs below {most:.0f} mm")
better = (errors.sel(controller="fast") < errors.sel(controller="slow")).mean()
print(f"The faster loop is better in {float(better):.0%} of the runs")
