"""
Poles and margins of the linearised loop
========================================

The whole closed loop, vehicle, motors and sampled controller, is linearised exactly at its equilibrium. Poles and
margins follow without a simulation.
"""

import jax
import matplotlib.pyplot as plt

import undertow as ut
from undertow.analysis.linearization import margins
from undertow.analysis.linearization.equilibrium import equilibrium
from undertow.simulation.loop.closed_loop import ClosedLoop

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose

plant = ut.plants.double_integrator(axes=1)
nothing, exact, hold = ut.disturbances.none(), ut.navigation.perfect(), ut.references.setpoint([0.0])
step = 1e-3  # s

# %%
# One axis with the robust variant, for three bandwidths of its estimator, whose damping ratio is 0.7. A faster
# estimator leaves less room for delay.

figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
for bandwidth in (10.0, 20.0, 40.0):  # rad/s
    law = ut.rcaf(plant.model(), preset="robust", bandwidth=bandwidth, damping=0.7)
    at = equilibrium(ClosedLoop(plant, law, hold, nothing, exact), dt=step, position=[0.0], load=[0.5])
    poles = margins.poles(margins.closed(at, dt=step))
    axes.plot(poles.real, poles.imag, "x", markersize=8, label=f"{bandwidth:g} rad/s")
    delay = margins.largest_delay(at, dt=step, most=1.0)
    print(f"bandwidth {bandwidth:g} rad/s: slowest pole {poles.real.max():.1f} 1/s, delay margin {1e3 * delay:.0f} ms")
axes.axvline(0.0, color="0.5", linewidth=0.8)
axes.set(xlabel="real part, 1/s", ylabel="imaginary part, rad/s")
axes.legend(title="bandwidth")
plt.show()
