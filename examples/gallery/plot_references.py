"""
References: lawn mower, helix, Lissajous figure
===============================================

A reference gives position, velocity and acceleration as functions of time. No plant is needed to look at one.
"""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose

references = {
    "lawn_mower": (ut.references.lawn_mower(length=10.0, spacing=2.0, count=4, speed=0.5), 104.0),
    "helix": (ut.references.helix(radius=2.0, period=40.0, sink_rate=0.05), 80.0),
    "lissajous": (ut.references.lissajous(), 2 * np.pi / 0.1),
}

# %%
# The paths, seen from above, with a mark every ten seconds.

figure, panels = plt.subplots(1, 3, figsize=(8, 3.0), layout="constrained")
for panel, (name, (reference, duration)) in zip(panels, references.items(), strict=True):
    time = jnp.arange(0.0, duration, 0.1)  # s
    target = jax.jit(jax.vmap(reference.at))(time)
    north, east = target.position[:, 0], target.position[:, 1]
    panel.plot(east, north)
    panel.plot(east[::100], north[::100], ".")
    panel.set(title=name, xlabel="east, m", ylabel="north, m", aspect="equal")
    speed = jnp.linalg.norm(target.velocity[:, :3], axis=1)
    acceleration = jnp.linalg.norm(target.acceleration[:, :3], axis=1)
    print(f"{name}: at most {float(speed.max()):.3f} m/s and {float(acceleration.max()):.3f} m/s²")
plt.show()
