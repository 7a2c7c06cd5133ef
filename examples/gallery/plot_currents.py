"""
Current profiles
================

Three currents of the catalogue: constant, sheared (it changes with depth) and a Gauss-Markov process (random, different
for every seed). Several disturbances in one scenario add.
"""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt

import undertow as ut
from undertow.core.contracts import Load, Pose

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose


@jax.jit
def northward(current, realization, times, depths):
    """Velocity of the water to the north, m/s, at times (s) and depths below the origin (m)."""

    def at(time, depth):
        pose = Pose(jnp.array([0.0, 0.0, depth]), jnp.eye(3), jnp.zeros(3))
        return current.at(realization, time, pose, Load(jnp.zeros(6), jnp.zeros(6))).water.velocity[0]

    return jax.vmap(at)(times, depths)


# %%
# Left: two profiles over depth. Right: three seeds of the random current.

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
depths = jnp.linspace(0.0, 25.0, 101)  # m
profiles = {
    "constant": ut.disturbances.current([0.5, 0.0, 0.0]),
    "sheared": ut.disturbances.sheared_current(depths=(0.0, 5.0, 20.0), velocities=((0.8, 0), (0.4, 0), (0.1, 0))),
}
for name, current in profiles.items():
    left.plot(northward(current, (), jnp.zeros(101), depths), depths, label=name)
left.set(xlabel="current to the north, m/s", ylabel="depth, m")
left.invert_yaxis()
left.legend()

random = ut.disturbances.gauss_markov_current(mean=(0.3, 0, 0), deviation=(0.1, 0.1, 0), correlation_time=60.0)
times = jnp.linspace(0.0, 600.0, 601)  # s
for seed in range(3):
    realization = random.realize(jax.random.key(seed))
    north = northward(random, realization, times, jnp.zeros(601))
    right.plot(times, north, label=f"seed {seed}")
    print(f"seed {seed}: mean {float(north.mean()):.3f} m/s, standard deviation {float(north.std()):.3f} m/s")
right.set(xlabel="time, s", ylabel="current to the north, m/s")
right.legend()
plt.show()
