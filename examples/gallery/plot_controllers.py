"""
PID, ADRC, INDI and the robust variant under the same disturbance
=================================================================

Four laws hold one axis under the same random load, which is large, sudden and fast: proportional-integral-derivative
control (PID), active disturbance rejection control (ADRC), incremental nonlinear dynamic inversion (INDI) and the
robust variant of the paper's law. The observers of the last three have the same bandwidth.
"""

import matplotlib.pyplot as plt

import undertow as ut

plant = ut.plants.double_integrator(axes=1)
model = plant.model()
load = ut.disturbances.random_suite(axes=1, span=10.0)
hold = ut.references.setpoint([0.0])
laws = {
    "PID": ut.controllers.pid(model, frequency=5.0),  # rad/s
    "ADRC": ut.controllers.adrc(model, bandwidth=20.0, feedback=(25.0, 10.0)),  # rad/s; 1/s^2, 1/s
    "INDI": ut.controllers.indi(model, bandwidth=20.0, feedback=(25.0, 10.0)),
    "robust": ut.rcaf(model, preset="robust", bandwidth=20.0, feedback=(25.0, 10.0)),
}
runs = {name: ut.simulate(plant, law, hold, disturbance=load, duration=10.0) for name, law in laws.items()}

# %%
# The load is the same for all of them, because the seed is the same. With the same bandwidth and the same feedback
# gains, the last three are nearly the same law.

styles = {"PID": "-", "ADRC": "-", "INDI": "--", "robust": ":"}
figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
for name, run in runs.items():
    axes.plot(run.dataset["time"], 1e3 * run.dataset["error"][:, 0], styles[name], label=name)
axes.set(xlabel="time, s", ylabel="position error, mm")
axes.legend()
plt.show()

# %%
for name, run in runs.items():
    print(f"{name}: {1e3 * run.metrics['steady']['position_rms']:.2f} mm rms")
