"""Laws with wrong models: every published parameter set of BlueROV2 Heavy as the vehicle, under every set as the model.

T200 thrusters at 16 V, three tasks, 80 s; errors are rms over the second half. A run is lost if it ends early, if its
position error exceeds 1 m rms, or if its attitude is ever more than 1.2 rad off in that half; it is bad above 0.2 m or
0.2 rad rms. `--readings` measures by sensors and the filter `observer` instead of perfectly.

    python benchmarks/foreign_models.py [--laws robust] [--rates 20,50,100] [--tasks lissajous,step,station]
        [--sets vonbenzon2022,wu2018,px4,ng2024,gazebo_box_drag] [--readings] [--options '{"bandwidth": 5}'] [--list]
        [--faster 1.5]

`--faster` multiplies the frequencies of the motions and the currents. `--list` prints the runs that are bad or lost as
well. Seven seconds a task, rate and law on two cores.
"""

import argparse
import itertools
import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from learning import errors_of

from undertow.analysis.metrics import Metrics
from undertow.core.runtime import double_outside_runs
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import RunPlan, numbers_of, with_numbers
from undertow.simulation.prepared_run import prepare_loop
from undertow.simulation.run_many import run_together

SETS = ("vonbenzon2022", "wu2018", "px4", "ng2024", "gazebo_box_drag")
DURATION, START, RECORD = 80.0, 40.0, 0.1  # s
LOST, BAD = (1.0, 1.2), (0.2, 0.2)  # m rms and rad at most; m rms and rad rms

TASKS = {
    "lissajous": {
        "reference": {"kind": "lissajous", "amplitude": [2.0, 1.0, 0.5, 0.8], "frequency": [0.2, 0.4, 0.3, 0.25]},
        "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0.0]}],
    },
    "step": {
        "reference": {"kind": "setpoint", "position": [2, 1, 0.5, 0, 0, 0.5], "settling": 5},
        "disturbance": [
            {"kind": "current", "velocity": [0.2, 0.0, 0.0]},
            {"kind": "waves", "height": 0.4, "period": 5},
        ],
    },
    "station": {
        "reference": {"kind": "setpoint", "position": [0] * 6},
        "disturbance": [{"kind": "current", "velocity": [0.5, 0.0, 0.0]}],
    },
}


class Errors(NamedTuple):
    """Of some runs, one entry each."""

    position: np.ndarray  # m rms
    attitude: np.ndarray  # rad rms
    farthest: np.ndarray  # largest error of attitude, rad
    variation: np.ndarray  # of an input, V/s
    ended: np.ndarray  # whether it ended early

    def lost(self) -> np.ndarray:
        """Which are lost."""
        return self.ended | ~(self.position <= LOST[0]) | ~(self.farthest <= LOST[1])

    def bad(self) -> np.ndarray:
        """Which are bad or lost."""
        return self.lost() | (self.position > BAD[0]) | (self.attitude > BAD[1])


def scenario_of(task: str, plant: str, model: str, law: str, rate: int, readings: bool, options: dict) -> dict:
    """Scenario of one run."""
    vehicle = lambda name: {"kind": "bluerov2_heavy", "parameters": name}
    measured = {"navigation": {"kind": "observer"}} if readings else {}
    return {
        "plant": {"vehicle": vehicle(plant), "thruster": {"kind": "t200", "supply": 16}, "ledger": False},
        "model": {"rate_term": True, "vehicle": vehicle(model)},
        "controller": {"kind": law} | options if options else law,
        "loop": {"dt": 1 / rate, "duration": DURATION, "record": RECORD},
        **TASKS[task],
        **measured,
    }


@double_outside_runs
def run_all(loops: Sequence[ClosedLoop], dt: float, seeds: Sequence[int], substeps: int = 1) -> Errors:
    """Runs of loops of one kind, as one SIMD batch, with some integration steps of the plant per `dt`, s."""
    metrics = (Metrics(START, DURATION, loops[0].plant.output_units),)
    plan = RunPlan(round(DURATION / dt), dt, round(RECORD / dt), ("position", "reference"), substeps=substeps)
    runs = [prepare_loop(loop, plan, seed, metrics) for loop, seed in zip(loops, seeds, strict=True)]
    # Vehicles name their sources, so that the trees differ in what is no number; the arrays are those of one kind,
    # but for gains: one number for all axes, or one per axis.
    shapes = [
        np.broadcast_shapes(*map(np.shape, same)) for same in zip(*(numbers_of(one.run) for one in runs), strict=True)
    ]
    alike = [
        [jnp.broadcast_to(leaf, shape) for leaf, shape in zip(numbers_of(one.run), shapes, strict=True)] for one in runs
    ]
    outcome = run_together([runs[0]._replace(run=with_numbers(runs[0].run, numbers)) for numbers in alike])
    state = jax.tree.map(np.asarray, outcome.accumulated[0])
    time = np.asarray(outcome.time)[0]
    late = time >= START
    position, target = (np.asarray(outcome.signals[name])[:, late] for name in ("position", "reference"))
    distance, angle = errors_of(target, np.nan_to_num(position, nan=1e6, posinf=1e6, neginf=1e6))
    return Errors(
        np.sqrt((distance**2).mean(1)),
        np.sqrt((angle**2).mean(1)),
        angle.max(1),
        state.variation / state.span,
        np.asarray(outcome.status) != 0,
    )


def hurry(factor: float) -> None:
    """Multiply the frequencies of all motions, and the currents."""
    for task in TASKS.values():
        if "frequency" in task["reference"]:
            task["reference"]["frequency"] = [factor * one for one in task["reference"]["frequency"]]
        for one in task["disturbance"]:
            if one["kind"] == "current":
                one["velocity"] = [factor * speed for speed in one["velocity"]]


def cases(options: Any, law: str, rate: int, task: str) -> tuple[list[tuple[str, str]], Errors]:
    """Pairs of vehicle and model, and the errors of their runs."""
    sets, more = options.sets.split(","), json.loads(options.options)
    pairs = list(itertools.product(sets, sets))
    built = [build(from_data(scenario_of(task, *pair, law, rate, options.readings, more))) for pair in pairs]
    return pairs, run_all([one.closed_loop for one in built], 1 / rate, [0] * len(built))


def main() -> None:
    """Print a line per law and rate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laws", default="robust")
    parser.add_argument("--rates", default="20,50,100")
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--sets", default=",".join(SETS))
    parser.add_argument("--options", default="{}")
    parser.add_argument("--readings", action="store_true")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--faster", type=float, default=1.0)
    options = parser.parse_args()
    hurry(options.faster)
    print(
        f"{'law':<24}{'Hz':>4}{'runs':>6}{'lost':>6}{'bad':>5}{'median':>9}{'90 %':>10}{'V/s':>7}   true model: lost,"
    )
    print(f"{'':<45}{'mm':>9}{'mm':>10}{'':>7}   median mm")
    for law, rate in itertools.product(options.laws.split(","), map(int, options.rates.split(","))):
        pairs, parts = [], []
        for task in options.tasks.split(","):
            some, found = cases(options, law, rate, task)
            pairs += [(task, *pair) for pair in some]
            parts.append(found)
        found = Errors(*(np.concatenate(rows) for rows in zip(*parts, strict=True)))
        right = np.array([vehicle == model for _, vehicle, model in pairs])
        off = np.sort(np.where(found.ended, np.inf, found.position)) * 1e3
        print(
            f"{law:<24}{rate:>4}{len(pairs):>6}{found.lost().sum():>6}{found.bad().sum():>5}{np.median(off):>9.1f}"
            f"{off[int(0.9 * len(off))]:>10.1f}{np.median(found.variation):>7.2f}   {(found.lost() & right).sum():>3}"
            f"{1e3 * np.median(found.position[right]):>8.1f}",
            flush=True,
        )
        for i in np.flatnonzero(found.bad()) if options.list else ():
            print(
                f"    {pairs[i]}: {found.position[i]:.3f} m, {found.attitude[i]:.3f} rad, {found.farthest[i]:.2f} rad"
            )


if __name__ == "__main__":
    main()
