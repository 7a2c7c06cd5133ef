"""
Inverted pendulum
=================

The paper's law is not bound to vehicles. Wang's pole on a cart follows a sine under the gains of Table 1, although the
nominal pole of the controller is 30 % too short.
"""

import matplotlib.pyplot as plt

import undertow as ut

plant = ut.plants.inverted_pendulum()
law = ut.rcaf(plant.model(half_length=0.35), preset="paper")  # m, of 0.5
sine = ut.references.sine(amplitude=0.1, frequency=1.0)  # rad, rad/s
run = ut.simulate(plant, law, sine, position=[0.0523], duration=20.0)  # rad, s

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
axes[0].plot(run.dataset["time"], run.dataset["position"], label="angle")
axes[0].plot(run.dataset["time"], run.dataset["reference"], "k:", label="reference")
axes[0].set(ylabel="angle, rad")
axes[0].legend()
axes[1].plot(run.dataset["time"], run.dataset["uncertainty"], "k:", label="true")
axes[1].plot(run.dataset["time"], run.dataset["estimate"], label="estimate")
axes[1].set(xlabel="time, s", ylabel="lumped uncertainty, rad/s²", ylim=(-0.15, 0.15))
axes[1].legend()
plt.show()

# %%
print(f"rms error over the steady window: {1e3 * run.metrics['steady']['attitude_rms']:.3g} mrad")
