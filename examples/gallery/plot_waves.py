"""
Wave spectrum and a realisation of it
=====================================

Waves are a sum of components that carry equal shares of the energy of a JONSWAP spectrum. A seed fixes their
frequencies and phases. The vehicle feels the orbital motion of the water, which decays with depth.
"""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import undertow as ut
from undertow.core.contracts import Load, Pose
from undertow.disturbances.waves import spectrum

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose

waves = ut.disturbances.waves(height=0.5, period=5.0, components=64)  # m, s
realization = waves.realize(jax.random.key(0))


def velocity(time, depth):
    """Velocity of the water at a depth below the surface, north, east, down, m/s."""
    pose = Pose(jnp.array([0.0, 0.0, depth - waves.depth]), jnp.eye(3), jnp.zeros(3))
    return waves.at(realization, time, pose, Load(jnp.zeros(6), jnp.zeros(6))).water.velocity


# %%
# The spectrum, with the frequencies of the realisation below it, and one minute of water motion at two depths.

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained", width_ratios=(2, 3))
frequency = jnp.linspace(0.6, 4.0, 400)  # rad/s
density = spectrum(frequency, waves.period, waves.peakedness)
left.plot(frequency, density / density.max())
left.plot(realization.frequency, np.zeros(64), "|", markersize=12)
left.set(xlabel="frequency, rad/s", ylabel="energy density, share of its peak")
time = jnp.linspace(0.0, 60.0, 601)  # s
for depth in (1.0, 6.0):  # m
    down = jax.vmap(lambda t, depth=depth: velocity(t, depth)[2])(time)
    right.plot(time, down, label=f"{depth:g} m deep: {float(down.std()):.3f} m/s rms")
right.set(xlabel="time, s", ylabel="velocity of the water, down, m/s")
right.legend()
plt.show()

# %%
# The components together have the energy of the sea state: the standard deviation of the surface is a quarter of the
# significant height. At the surface, vertical velocity divided by frequency is elevation.

amplitude = 0.25 * float(waves.height) * np.sqrt(2 / 64)
print(f"Standard deviation of the surface: {np.sqrt(64 * amplitude**2 / 2):.4f} m")
print(f"A quarter of the significant height: {float(waves.height) / 4:.4f} m")
