"""Compare undertow's vehicles, and a closed loop, with the same ones in MuJoCo's C engine.

python examples/mujoco_comparison.py [FIGURE.png]          needs the extra: pip install ".[mujoco]"
"""

import sys

import jax
import jax.numpy as jnp
import numpy as np

import undertow as ut
from undertow.outside.mujoco_engine import MujocoRun, Submerged, UniformFlow, run_in_mujoco

CURRENT = [0.3, 0.2, 0.0]  # m/s: north, east, down


def main(fast: bool = False, figure: str | None = None) -> dict[str, float]:
    """Print the differences; `fast` takes one vehicle, fewer states and a shorter run.

    Returns:
        Differences by the names that are printed.
    """
    found = {}
    for name in ("odin",) if fast else ("odin", "bluerov2_heavy", "rexrov"):
        found[f"nu_dot of {name}"] = accelerations(getattr(ut.vehicles, name)(), states=5 if fast else 50)
    run, mujoco_run = both_runs(duration=1.0 if fast else 12.0)
    gap = np.abs(mujoco_run.position - run.dataset.position.values).max(axis=0)
    found["position, m"] = float(gap[:3].max())
    found["attitude, rad"] = float(gap[3:].max())
    found["voltage, V"] = float(np.abs(mujoco_run.voltage - run.dataset["input"].values).max())
    for name, difference in found.items():
        print(f"{name:<26}{difference:8.0e}")
    print(f"run of {mujoco_run.time[-1]:g} s: undertow {run.status.word}, MuJoCo {mujoco_run.status.word}")
    if figure:
        plot(run, mujoco_run, figure)
    return found


def accelerations(vehicle, states: int) -> float:
    """Largest difference of nu_dot at random states in still water, as a share of its largest entry."""
    plant, body = ut.HybridVehicle(vehicle, ut.thrusters.t200()), Submerged(vehicle)
    rate = jax.jit(lambda x, volts: plant.dynamics(jnp.zeros(()), x, volts, plant.no_load()).nu)
    chance, worst = np.random.default_rng(1), 0.0
    for _ in range(states):
        eta, nu = chance.uniform(-1.4, 1.4, 6), chance.uniform(-1, 1, 6)  # m, rad, m/s, rad/s
        thrust = chance.uniform(-40, 40, vehicle.thrusters)  # N
        x = plant.initial_state(jnp.asarray(eta))._replace(nu=jnp.asarray(nu))
        x = x._replace(thrusters=x.thrusters._replace(speed=plant.thruster.motor.speed_at(jnp.asarray(thrust))))
        body.place(eta, nu)
        here, there = np.asarray(rate(x, jnp.zeros(vehicle.thrusters))), body.acceleration(thrust)
        worst = max(worst, np.abs(there - here).max() / np.abs(here).max())
    return float(worst)


def both_runs(duration: float) -> tuple[ut.Run, MujocoRun]:
    """A BlueROV2 Heavy moves 2 m in a current, controlled at 100 Hz: in undertow, and in MuJoCo."""
    thruster = ut.thrusters.t200(supply=16.0)
    plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), thruster)
    law = ut.rcaf(  # gains that a motor with a lag of 0.1 s allows
        plant.model(rate_term=True),
        preset="paper",
        feedback=[[4, 7]] * 3 + [[20, 13]] * 3,
        pole=[4, 4, 4, 3, 3, 3],
        adaptation=[0.15] * 3 + [0.05] * 3,
        composite=[150] * 3 + [200] * 3,
        robust_gain=0.1,
        compensation_gain=0,
        weights_bound=40,
    )
    reference = ut.references.setpoint([2, 1, 1, 0, 0, 0.5], settling=8.0)
    current = ut.disturbances.current(CURRENT)
    run = ut.simulate(plant, law, reference, disturbance=current, duration=duration, dt=0.01, record=0.01)
    body = Submerged(plant.vehicle, water=UniformFlow(CURRENT))
    return run, run_in_mujoco(body, thruster, law, reference, duration=duration, dt=0.01)


def plot(run: ut.Run, mujoco_run: MujocoRun, figure: str) -> None:
    """Both paths, and the difference between them."""
    import matplotlib.pyplot as plt

    here = run.dataset.position.values
    _, (path, gap) = plt.subplots(2, 1, sharex=True, layout="constrained")
    path.plot(mujoco_run.time, mujoco_run.position[:, :3], label=["north", "east", "down"])
    path.plot(mujoco_run.time, here[:, :3], "k:")
    path.set(ylabel="m", title="MuJoCo (lines) and undertow (dots)")
    path.legend()
    gap.semilogy(mujoco_run.time[1:], np.abs(mujoco_run.position - here)[1:, :3])
    gap.set(xlabel="time, s", ylabel="difference, m")
    plt.savefig(figure)
    plt.close()


if __name__ == "__main__":
    main(figure=sys.argv[1] if len(sys.argv) > 1 else None)
