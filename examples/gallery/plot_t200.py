"""
Thrust curve and dead zone of a T200
====================================

The Blue Robotics T200 as a brushed DC motor that was fitted to the manufacturer's table. A thruster is a set of pure
functions, so its steady state can be computed without a run.
"""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import undertow as ut

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose

voltage = jnp.linspace(-16.0, 16.0, 641)  # V
static = ut.thrusters.t200(fidelity="static")
thrust = static.thrust(static.initial_state(len(voltage)), voltage)
current = static.current(static.initial_state(len(voltage)), voltage)

# %%
# The propeller is weaker in reverse, and small voltages have no effect at all.

figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
left.plot(voltage, thrust)
left.set(xlabel="voltage, V", ylabel="thrust, N")
right.plot(voltage, current)
right.set(xlabel="voltage, V", ylabel="current, A")
plt.show()

# %%
silent = np.abs(voltage[np.asarray(thrust) == 0.0]).max()
print(f"Thrust at 16 V: {thrust[-1]:.1f} N forward, {-thrust[0]:.1f} N in reverse")
print(f"Current at 16 V: {current[-1]:.1f} A")
print(f"No thrust up to {silent:.2f} V")
