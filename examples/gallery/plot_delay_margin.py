"""
A predicted delay margin, and runs beside it
============================================

The linearised loop says how much delay between measurement and controller it survives. Three runs with less, about as
much and more delay show whether that is true.
"""

import jax
import matplotlib.pyplot as plt
import numpy as np

import undertow as ut
from undertow.analysis.linearization import margins
from undertow.analysis.linearization.equilibrium import equilibrium
from undertow.simulation.loop.closed_loop import ClosedLoop

jax.config.update("jax_enable_x64", True)  # outside of a run, the precision is yours to choose

plant = ut.plants.double_integrator(axes=1)
law = ut.controllers.pid(plant.model(), frequency=2.0)  # rad/s
hold = ut.references.setpoint([0.0])
step = 0.01  # s
loop = ClosedLoop(plant, law, hold, ut.disturbances.none(), ut.navigation.perfect())
margin = margins.largest_delay(equilibrium(loop, dt=step, position=[0.0], load=[0.0]), dt=step, most=2.0)
print(f"Predicted delay margin: {1e3 * margin:.0f} ms")

# %%
# The runs start 1 cm off. Delays are whole sampling times.

figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for share in (0.7, 0.95, 1.1):
    delay = step * round(share * margin / step)
    delayed = ut.navigation.degraded(delay=delay, sampling_time=step)
    run = ut.simulate(plant, law, hold, navigation=delayed, position=[0.01], duration=20.0, dt=step)
    error = 1e3 * run.dataset["error"][:, 0]
    axes.plot(run.dataset["time"], error, label=f"{1e3 * delay:.0f} ms")
    early, late = (float(np.abs(error.sel(time=slice(*window))).max()) for window in ((2, 6), (16, 20)))
    word = "grows" if late > early else "decays"
    print(f"{1e3 * delay:.0f} ms: the oscillation {word}, from {early:.2g} to {late:.2g} mm")
axes.set(xlabel="time, s", ylabel="position error, mm", ylim=(-15, 15))
axes.legend(title="delay")
plt.show()
