"""
Magnetic levitation
===================

A ball below a magnet under the gains of Table 1. The currents of the coils lag behind the voltages, which the law does
not know. The lag grows towards the upper magnet, and there the loop begins to oscillate.
"""

import matplotlib.pyplot as plt

import undertow as ut

plant = ut.plants.magnetic_levitation()
law = ut.rcaf(plant.model(force_factor=1.0), preset="paper")
runs = {}
for offset in (0.010, 0.006):  # m below the upper magnet
    sine = ut.references.sine(amplitude=0.001, frequency=1.0, offset=offset)
    runs[offset] = ut.simulate(plant, law, sine, position=[offset], duration=10.0)

# %%
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for offset, run in runs.items():
    lived = run.dataset.sel(time=slice(0, run.dataset.attrs["ended"]))
    axes.plot(lived["time"], 1e3 * lived["error"][:, 0], label=f"{1e3 * offset:g} mm below the magnet")
    largest = 1e3 * float(abs(lived["error"].sel(time=slice(5.0, None))).max())
    print(f"{1e3 * offset:g} mm: {run.status.word}, error of at most {largest:.2g} mm after 5 s")
axes.set(xlabel="time, s", ylabel="tracking error, mm", ylim=(-1, 1))
axes.legend()
plt.show()
