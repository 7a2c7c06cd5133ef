"""
Sensors and the error of the navigation observer
================================================

A vehicle does not know its position, it estimates it. The observer integrates an inertial measurement unit (IMU) and
corrects it with a Doppler velocity log (DVL), depth, compass and acoustic position fixes, each with its own period,
noise, bias and delay.
"""

import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200())
law = ut.controllers.pid(plant.model(), sampling_time=0.01, frequency=1.0)
hold = ut.references.setpoint([0.0] * 6)
water = [ut.disturbances.current([0.3, 0.2, 0.0]), ut.disturbances.waves()]

s = ut.sensors
common = [s.imu(), s.depth(), s.compass(), s.position_fix(period=1.0, noise=0.05)]  # s, m
observers = {"with DVL": ut.navigation.observer([*common, s.dvl()]), "without DVL": ut.navigation.observer(common)}
runs = {
    name: ut.simulate(plant, law, hold, disturbance=water, navigation=one, dt=0.01, record=0.05, duration=30.0)
    for name, one in observers.items()
}

# %%
# Measured less true position to the north. The estimate is wrong by centimetres, and no controller can be better than
# what it is given.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for name, run in runs.items():
    data = run.dataset.sel(axis="north")
    error = 1e3 * (data["measured_position"] - data["position"])
    axes.plot(data["time"], error, label=name)
    print(f"{name}: {float(np.sqrt((error**2).mean())):.1f} mm rms to the north")
axes.set(xlabel="time, s", ylabel="measured less true, mm")
axes.legend()
plt.show()
