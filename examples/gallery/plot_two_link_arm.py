"""
Two-link arm with an unknown load
=================================

A planar arm lifts a load that its nominal model does not contain. Its gain matrix, the inverse of the inertia matrix,
changes with the angle of the elbow.
"""

import matplotlib.pyplot as plt

import undertow as ut

plant = ut.plants.two_link_arm()
law = ut.rcaf(plant.model(outer_mass=1.0, outer_offset=0.0), preset="paper")  # kg of 2; rad
sine = ut.references.sine(amplitude=[1.0, 1.0], frequency=[1.0, 2.0])  # rad, rad/s
run = ut.simulate(plant, law, sine, duration=10.0)

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
for number, joint in enumerate(("shoulder", "elbow")):
    axes[0].plot(run.dataset["time"], run.dataset["error"][:, number], label=joint)
    axes[1].plot(run.dataset["time"], run.dataset["input"][:, number], label=joint)
axes[0].set(ylabel="tracking error, rad")
axes[0].legend()
axes[1].set(xlabel="time, s", ylabel="torque, N m")
plt.show()

# %%
for joint, rms in zip(("shoulder", "elbow"), run.metrics["steady"]["error_rms_axes"], strict=True):
    print(f"{joint}: {1e3 * rms:.3g} mrad rms")
