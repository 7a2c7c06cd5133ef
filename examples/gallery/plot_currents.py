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


def velocity(disturbance, realization, time, depth):
    """Velocity of the water at a depth below the origin, north, east, down, m/s."""
    pose = Pose(jnp.array([0.0, 0.0, depth]), jnp.eye(3), jnp.zeros(3))
    return disturbance.at(realization, time, pose, Load(jnp.zeros(6), jnp.zeros(6))).water.velocity


# %%
# Left: two profiles over depth. Right: three seeds of the random current.

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
depths = jnp.linspace(0.0, 25.0, 101)  # m
profiles = {
    "constant": ut.disturbances.current([0.5, 0.0, 0.0]),
    "sheared": ut.disturbances.sheared_current(depths=(0.0, 5.0, 20.0), velocities=((0.8, 0), (0.4, 0), (0.1, 0))),
}
for name, current in profiles.items():
    north = jax.vmap(lambda depth, current=current: velocity(current, (), 0.0, depth)[0])(depths)
    left.plot(north, depths, label=name)
left.set(xlabel="current to the north, m/s", ylabel="depth, m")
left.invert_yaxis()
left.legend()

random = ut.disturbances.gauss_markov_current(mean=(0.3, 0, 0), deviation=(0.1, 0.1, 0), correlation_time=60.0)
times = jnp.linspace(0.0, 600.0, 601)  # s
for seed in range(3):
    realization = random.realize(jax.random.key(seed))
    north = jax.vmap(lambda t, realization=realization: velocity(random, realization, t, 0.0)[0])(times)
    right.plot(times, north, label=f"seed {seed}")
    print(f"seed {seed}: mean {float(north.mean()):.3f} m/s, standard deviation {float(north.std()):.3f} m/s")
right.set(xlabel="time, s", ylabel="current to the north, m/s")
right.legend()
plt.show()
