"""Where fuzzy rules represent the uncertainty better than v and v |v|: least squares on recorded runs, no control.

BlueROV2 Heavy (parameters vonbenzon2022) with the model wu2018, preset `learning` at 50 Hz. The uncertainty of the
second lap is fitted, that of the third is predicted: rms of what remains, of the linear accelerations (m/s^2) and of
the angular ones (rad/s^2), and in brackets over that of the linear regressor. The regressors are those of the
reference. Inputs of thrusters are those of the lap before, because those of the same instant hold the answer: the law
has already reacted.

    python benchmarks/learning_rules.py [--motions lissajous,six_axis,lawn_mower] [--cases still,current,waves,thruster]
"""

import argparse
from typing import Any

import jax
import numpy as np
from learning import LAWS, SEA, motions
from learning_tasks import built
from scipy.spatial.transform import Rotation

from undertow.simulation.loop.loop_runs import RunPlan
from undertow.simulation.prepared_run import prepare_loop
from undertow.simulation.run_many import run_together

jax.config.update("jax_enable_x64", True)

CASES: dict[str, dict[str, Any]] = {
    "still": {},
    "current": {"disturbance": SEA[:1]},
    "waves": {"disturbance": SEA},
    "thruster": {"faults": [{"target": "thruster 2", "mode": "scale", "severity": 0.5, "onset": 0}]},
}
SPEED, LARGEST_INPUT = 0.5, 8.0  # m/s and rad/s, V: of the outermost sets
Series = dict[str, np.ndarray]


def recorded(case: str, motion: str) -> tuple[Series, float]:
    """Three laps, ten records per second, with the motion of the reference; duration of a lap, s."""
    loop, lap = built(LAWS["linear"], 50, CASES[case], motion), motions()[motion][1]
    plan = RunPlan(round(3 * lap * 50), 0.02, 5, ("uncertainty", "input"))
    outcome = run_together([prepare_loop(loop, plan, 1000)])
    time = np.asarray(outcome.time)[0]
    target = jax.vmap(loop.reference.at)(time)
    known = {"time": time, "position": np.array(target.position), "velocity": np.array(target.velocity)}
    return known | {name: np.asarray(series)[0] for name, series in outcome.signals.items()}, lap


def rules(x: np.ndarray, largest: float, sets: int = 5) -> np.ndarray:
    """Normalised Gaussian memberships of one quantity without the middle set, less their values at zero."""
    centres = np.linspace(-largest, largest, sets)
    weigh = lambda x: np.exp(
        -(((np.clip(x, -2 * largest, 2 * largest)[:, None] - centres) / (centres[1] - centres[0])) ** 2)
    )
    share = lambda x: weigh(x) / weigh(x).sum(1, keepdims=True)
    return np.delete(share(x) - share(np.zeros(1)), sets // 2, 1)


def regressors(known: Series, lap: float, water: np.ndarray) -> dict[str, list[np.ndarray]]:
    """Columns of each regressor that is compared; `water` is the current, m/s, world axes."""
    step = known["time"][1]
    turn = Rotation.from_euler("ZYX", known["position"][:, :2:-1])
    roll, pitch = known["position"][:, 3], known["position"][:, 4]
    rates = known["velocity"][:, 3:]
    spin = np.stack(
        [
            rates[:, 0] - np.sin(pitch) * rates[:, 2],
            np.cos(roll) * rates[:, 1] + np.sin(roll) * np.cos(pitch) * rates[:, 2],
            -np.sin(roll) * rates[:, 1] + np.cos(roll) * np.cos(pitch) * rates[:, 2],
        ],
        1,
    )
    down = turn.inv().apply(np.array([0.0, 0.0, 1.0]))
    over_ground = np.hstack([turn.inv().apply(known["velocity"][:, :3]), spin])
    acceleration = np.gradient(over_ground, step, axis=0)

    def shared(velocity):
        u, w = velocity[:, :3] / SPEED, velocity[:, 3:] / SPEED
        products = [u * np.roll(u, -1, 1), w * np.roll(u, -1, 1), w * np.roll(u, -2, 1)]
        return [np.ones((len(u), 1)), acceleration, down - [0.0, 0.0, 1.0], *products]

    linear = lambda velocity: [velocity / SPEED, velocity / SPEED * np.abs(velocity / SPEED)]
    fuzzy = lambda velocity, which: [rules(velocity[:, axis], SPEED) for axis in which]
    v, through = over_ground, over_ground.copy()
    through[:, :3] -= turn.inv().apply(water)
    late = round(lap / step)
    before = np.vstack([np.repeat(known["input"][:1], late, 0), known["input"][:-late]])
    plain = [*shared(v), *linear(v)]
    return {
        "linear": plain,
        "linear and v^2": [*plain, (v / SPEED) ** 2],
        "rules": [*shared(v), *fuzzy(v, range(6))],
        "both": [*plain, *fuzzy(v, range(6))],
        "both, surge only": [*plain, *fuzzy(v, [0])],
        "both, sway only": [*plain, *fuzzy(v, [1])],
        "both, heave only": [*plain, *fuzzy(v, [2])],
        "both, turning only": [*plain, *fuzzy(v, [3, 4, 5])],
        "linear, water": [*shared(through), *linear(through)],
        "linear, thrusters": [*plain, before, before * np.abs(before)],
        "linear, rules of thrusters": [*plain, *(rules(one, LARGEST_INPUT, 7) for one in before.T)],
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", default="lissajous,six_axis,lawn_mower")
    parser.add_argument("--cases", default=",".join(CASES))
    chosen = parser.parse_args()
    for case in chosen.cases.split(","):
        water = np.asarray(SEA[0]["velocity"]) if case in ("current", "waves") else np.zeros(3)
        for motion in chosen.motions.split(","):
            known, lap = recorded(case, motion)
            second, third = ((known["time"] > k * lap) & (known["time"] <= (k + 1) * lap) for k in (1, 2))
            base = None
            for name, columns in regressors(known, lap, water).items():
                phi, d = np.hstack(columns), known["uncertainty"]
                fitted, size = phi[second], phi.shape[1]
                ridge = 1e-8 * len(fitted) * np.eye(size)
                weights = np.linalg.solve(fitted.T @ fitted + ridge, fitted.T @ d[second])
                rest = (d[third] - phi[third] @ weights) ** 2
                value = np.array([np.sqrt(rest[:, part].sum(1).mean()) for part in (slice(3), slice(3, 6))])
                base = value if base is None else base
                print(
                    f"{case:<9}{motion:<11}{name:<27}{size:>4} entries {value[0]:7.4f} m/s^2 ({value[0] / base[0]:.2f})"
                    f"  {value[1]:7.4f} rad/s^2 ({value[1] / base[1]:.2f})",
                    flush=True,
                )


if __name__ == "__main__":
    main()
