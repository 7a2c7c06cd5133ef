"""
Where the energy goes
=====================

Every run with a motor model keeps an energy ledger: what the battery gives, what heats windings and battery, and what
the propellers give to the water. Its residual shows whether the equations conserve energy.
"""

import matplotlib.pyplot as plt

import undertow as ut

plant = ut.HybridVehicle(
    ut.vehicles.bluerov2_heavy(), ut.thrusters.t200(), battery=ut.power.battery(), esc=ut.power.esc()
)
law = ut.controllers.pid(plant.model(), sampling_time=0.01)
path = ut.references.lawn_mower(length=5.0, spacing=2.0, count=2, speed=0.5)
run = ut.simulate(plant, law, path, dt=0.01, record=0.1, duration=40.0)

# %%
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
parts = {"water": "water", "copper": "windings", "battery": "battery"}
joules = [run.dataset[f"energy_{name}"] for name in parts]
axes.stackplot(run.dataset["time"], joules, labels=list(parts.values()))
axes.plot(
    run.dataset["time"], run.dataset["energy_source"] + run.dataset["energy_battery"], "k:", label="from the cells"
)
axes.set(xlabel="time, s", ylabel="energy, J")
axes.legend(loc="upper left")
plt.show()

# %%
taken = float(run.dataset["energy_source"][-1])
for name, words in parts.items():
    print(f"{words}: {float(run.dataset[f'energy_{name}'][-1]):.0f} J")
print(f"residual of the balance: {abs(float(run.dataset['energy_residual'][-1])) / taken:.1e} of {taken:.0f} J")
