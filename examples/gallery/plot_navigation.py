"""
Sensors and the error of the navigation observer
================================================

A vehicle does not know its position but estimates it. The observer integrates an inertial measurement unit (IMU) and
corrects it with a Doppler velocity log (DVL), depth, compass and acoustic position fixes, each with its own period,
noise, bias and delay.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200())
law = ut.controllers.pid(plant.model(), sampling_time=0.01, frequency=1.0)
hold = ut.references.setpoint([0.0] * 6)
current = ut.disturbances.current([0.2, 0.1, 0.0])  # m/s

s = ut.sensors
observer = ut.navigation.observer([s.imu(), s.dvl(), s.depth(), s.compass(), s.position_fix(period=1.0, noise=0.05)])
run = ut.simulate(plant, law, hold, disturbance=current, navigation=observer, dt=0.01, record=0.05, duration=30.0)

# %%
# Measured less true position. The horizontal estimate wanders by centimetres, and no controller can hold the position
# better than that. Depth has a sensor of its own.

error = 1e3 * (run.dataset["measured_position"] - run.dataset["position"])
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for axis in ("north", "east", "down"):
    axes.plot(run.dataset["time"], error.sel(axis=axis), label=axis)
    print(f"{axis}: {float(np.sqrt((error.sel(axis=axis) ** 2).mean())):.1f} mm rms")
axes.set(xlabel="time, s", ylabel="measured less true, mm")
axes.legend()
plt.show()
