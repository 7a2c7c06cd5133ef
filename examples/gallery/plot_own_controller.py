"""
A controller of your own
========================

A controller is a class with four methods. This one adds a drag term to a proportional-derivative law: it uses the
nominal model to turn a desired acceleration into voltages.
"""

import jax.numpy as jnp
import matplotlib.pyplot as plt

import undertow as ut
from undertow.core.contracts import AbstractController, Model
from undertow.core.param import Param, param


class ComputedAcceleration(AbstractController):
    """Proportional-derivative control of the acceleration, on the nominal model."""

    model: Model
    frequency: Param = param("rad/s", "natural frequency of the tracking error")

    def init(self, y, r):
        return ()

    def command(self, z, y, r):
        error, rate, acceleration = self.model.coordinates.tracking_error(y, r)
        desired = acceleration + 2 * self.frequency * rate + self.frequency**2 * error
        return self.model.dynamics.invert(y, desired - self.model.dynamics.drift(y)), {}

    def advance(self, z, y, r, u_applied, dt):
        return z

    def signals(self):
        return {}


# %%
# It runs like any other. In a scenario it stands as ``kind: ./my_controller.py:my_function``.

plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3(fidelity="static"))
goal = ut.references.setpoint([1, 1, 1, 0, 0, 0.5], settling=5.0)  # m, rad; s
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for frequency in (1.0, 2.0, 4.0):  # rad/s
    law = ComputedAcceleration(plant.model(), jnp.asarray(frequency))
    run = ut.simulate(plant, law, goal, disturbance=ut.disturbances.current([0.2, 0.1, 0.0]), dt=0.01)
    axes.plot(run.dataset["time"], 1e3 * run.dataset["error"][:, 0], label=f"{frequency:g} rad/s")
    print(f"{frequency:g} rad/s: {1e3 * run.metrics['steady']['position_rms']:.2f} mm rms per axis")
axes.set(xlabel="time, s", ylabel="error to the north, mm")
axes.legend(title="frequency")
plt.show()
