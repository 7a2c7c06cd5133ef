"""
A Monte Carlo study in Python
=============================

Sixty-four runs with random currents and an uncertain vehicle, and the empirical distribution function (ECDF) of their
error. For thousands of runs, ``undertow campaign`` compiles them as a batch and resumes after interruptions.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

scenario = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": "t200", "ledger": False},
    "controller": {"kind": "pid"},
    "reference": {"kind": "setpoint", "position": [0.0] * 6},
    "disturbance": [{"kind": "gauss_markov_current", "span": 20}, {"kind": "parameter_error"}],
    "loop": {"duration": 10.0, "dt": 0.01, "record": 0.1},
}
errors = []
for seed in range(64):
    run = ut.simulate_scenario({**scenario, "seed": seed})
    errors.append(1e3 * run.metrics["steady"]["position_rms"])

# %%
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
axes.ecdf(errors)
axes.set(xlabel="position error, mm rms per axis", ylabel="share of the runs at or below")
plt.show()

# %%
print(f"median {np.median(errors):.2f} mm, 95 % of the runs below {np.quantile(errors, 0.95):.2f} mm")
