"""
Wave spectrum and a realization of it
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
from undertow.physics.disturbances.waves import spectrum

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose

waves = ut.disturbances.waves(height=0.5, period=5.0, components=64)  # m, s
realization = waves.realize(jax.random.key(0))


@jax.jit
def sinking(times, depth):
    """Downward velocity of the water at a depth below the surface, m/s; times in s."""
    pose = Pose(jnp.array([0.0, 0.0, depth - waves.depth]), jnp.eye(3), jnp.zeros(3))
    still = Load(jnp.zeros(6), jnp.zeros(6))
    return jax.vmap(lambda t: waves.at(realization, t, pose, still).water.velocity[2])(times)


# %%
# The spectrum, with the frequencies of the realization below it, and one minute of water motion at two depths.

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained", width_ratios=(2, 3))
frequency = jnp.linspace(0.6, 4.0, 400)  # rad/s
density = spectrum(frequency, waves.period, waves.peakedness)
left.plot(frequency, density / density.max())
left.plot(realization.frequency, np.zeros(64), "|", markersize=12)
left.set(xlabel="frequency, rad/s", ylabel="energy density, share of its peak")
time = jnp.linspace(0.0, 60.0, 601)  # s
for depth in (1.0, 6.0):  # m
    down = sinking(time, depth)
    right.plot(time, down, label=f"{depth:g} m deep: {float(down.std()):.3f} m/s rms")
right.set(xlabel="time, s", ylabel="velocity of the water, down, m/s")
right.legend()
plt.show()

# %%
# The surface itself is the integral of the vertical velocity there. The significant height of a sea state is four times
# the standard deviation of its surface.

long = jnp.arange(0.0, 600.0, 0.1)  # s
surface = jnp.cumsum(-sinking(long, 0.0)) * 0.1
print(f"Significant height of ten minutes of this realization: {4 * float(surface.std()):.3f} m")
print(f"Significant height asked for: {float(waves.height):.3f} m")
