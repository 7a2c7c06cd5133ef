"""
Magnetic levitation
===================

A ball between two coils under the gains of Table 1. The coils are a lag that the law does not know; it grows with the
distance from the upper magnet.
"""

import matplotlib.pyplot as plt

import undertow as ut

plant = ut.plants.magnetic_levitation()
law = ut.rcaf(plant.model(force_factor=1.0))
runs = {}
for offset in (0.010, 0.006):  # m below the upper magnet
    sine = ut.references.sine(amplitude=0.001, frequency=1.0, offset=offset)
    runs[offset] = ut.simulate(plant, law, sine, position=[offset], duration=10.0)

# %%
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for offset, run in runs.items():
    lived = run.dataset.sel(time=slice(0, run.dataset.attrs["ended"]))
    axes.plot(lived["time"], 1e3 * lived["error"][:, 0], label=f"{1e3 * offset:g} mm below the magnet")
    print(f"{1e3 * offset:g} mm: {run.status.word} at {run.dataset.attrs['ended']:.3g} s")
axes.set(xlabel="time, s", ylabel="tracking error, mm", ylim=(-1, 1))
axes.legend()
plt.show()
