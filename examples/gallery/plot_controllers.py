"""
PID, ADRC, INDI and the robust variant under the same waves
===========================================================

Four laws keep a BlueROV2 Heavy on its station in the same current and the same waves: proportional-integral-derivative
control (PID), active disturbance rejection control (ADRC), incremental nonlinear dynamic inversion (INDI) and the
robust variant of the paper's law. None of them was tuned for this scenario.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200())
hold = ut.references.setpoint([0.0] * 6)
water = [ut.disturbances.current([0.3, 0.2, 0.0]), ut.disturbances.waves(height=0.5, period=5.0)]
model = plant.model()
laws = {
    "PID": ut.controllers.pid(model, sampling_time=0.01),
    "ADRC": ut.controllers.adrc(model, bandwidth=4.0),
    "INDI": ut.controllers.indi(model, bandwidth=4.0),
    "robust": ut.rcaf(model, preset="robust", sampling_time=0.01),
}
runs = {name: ut.simulate(plant, law, hold, disturbance=water, dt=0.01, record=0.05) for name, law in laws.items()}

# %%
figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
for name, run in runs.items():
    error = 1e3 * np.linalg.norm(run.dataset["error"][:, :3], axis=1)
    axes.plot(run.dataset["time"], error, "--" if name == "INDI" else "-", label=name)
axes.set(xlabel="time, s", ylabel="position error, mm")
axes.legend()
plt.show()

# %%
# The water is the same for all of them, because the seed is the same. ADRC and INDI of the same bandwidth coincide.

for name, run in runs.items():
    steady = run.metrics["steady"]
    print(f"{name}: {1e3 * steady['position_rms']:.1f} mm rms per axis, {steady['energy']:.0f} J")
