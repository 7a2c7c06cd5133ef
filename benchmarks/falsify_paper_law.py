"""Failures of the paper's law that 1,000 random samples do not find: noise, delay and motor inductance.

The law has the gains of Table 1, and the vehicle is ODIN with the motors of Table 3 at the electromechanical level, but
a winding of 1 mH. Of the box of bounds, the largest share is sought in which 1,000 samples, uniform and each with a
seed of its own, break no requirement. `undertow falsify` then looks for a failure in the same box.

    python benchmarks/falsify_paper_law.py [--samples 1000] [--budget 2000] [--share S] [--seed N] [--out DIR]
"""

import argparse
import math
import tempfile
import time
from pathlib import Path

import numpy as np

from undertow.cli.trials import trial_text
from undertow.scenario.reading import Text, from_data, read
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.falsification.evaluator import Evaluator
from undertow.studies.falsification.falsify import Falsified, evaluator_of, falsify

# Bounds of the full box: nominal value, upper bound, unit. The nominal values are the lower bounds. At each upper bound
# the law fails, with the other two at their nominal values.
VARY = {
    "plant.thruster.inductance": (1e-3, 2.2e-3, "H"),
    "navigation.velocity_noise": (0.0, 0.07, "m/s, rad/s"),
    "navigation.delay": (0.0, 1e-3, "s"),
}
STEPS = 8  # of the bisection of the share
SEEDS = 10_000  # that the runs of the search have in turn


def scenario(share: float, duration: float) -> Text:
    """The scenario with a share of the full box as its bounds."""
    between = lambda nominal, high: {"between": [nominal, nominal + share * (high - nominal)]}
    return from_data(
        {
            "description": "The law of the paper with full motor models, sampled at 5 kHz",
            "plant": {
                "vehicle": "odin",
                "thruster": {"kind": "paper_table3", "fidelity": "electromechanical", "inductance": 1e-3},
                "ledger": False,
            },
            "controller": {"kind": "rcaf", "preset": "paper"},
            "reference": {"kind": "setpoint", "position": [2.0, 3.0, 4.0, math.pi / 3, math.pi / 4, 2 * math.pi / 5]},
            "disturbance": "u1",
            "navigation": {"kind": "degraded", "velocity_noise": 0.0, "delay": 0.0},
            "loop": {"duration": duration, "dt": 2e-4, "record": 1e-2},
            "requirements": {
                "settles": {"formula": "within 8 s always (position_error < 0.1 and attitude_error < 0.1)"}
            },
            "falsify": {
                "vary": {key: between(nominal, high) for key, (nominal, high, _) in VARY.items()},
                "seeds": SEEDS,
            },
        }
    )


def failures(evaluator: Evaluator, points: np.ndarray, seeds: list[int] | None) -> int:
    """How many points of the unit cube break the requirement."""
    return int((evaluator.each(evaluator.box.of_cube(points), seeds) <= 0).any(axis=1).sum())


def largest_quiet_box(points: np.ndarray, seeds: list[int], duration: float) -> tuple[float, float, int]:
    """Largest share of the full box without a failing sample, the next larger share tried, and failures there."""
    quiet, loud, there = 0.0, 1.0, failures(evaluator_of(scenario(1.0, duration)), points, seeds)
    print(f"share 1: {there} of {len(points)} samples fail", flush=True)
    for _ in range(STEPS):
        share = (quiet + loud) / 2
        count = failures(evaluator_of(scenario(share, duration)), points, seeds)
        print(f"share {share:.4g}: {count} of {len(points)} samples fail", flush=True)
        if count:
            loud, there = share, count
        else:
            quiet = share
    return quiet, loud, there


def report(found: Falsified, folder: Path) -> None:
    """Print what was found, and repeat it from its file."""
    objective, violation = found.objective, found.violation
    if violation is None:
        print(f"falsify: no failure in {objective.runs} runs, least robustness {min(objective.robustnesses):.4g}")
        return
    first = objective.violations[0]
    print(f"falsify: first failure at run {first.runs}, size {first.size:.4g} of the bounds")
    print(f"falsify: seed {violation.seed} of {SEEDS}")
    print(f"falsify: smallest failure after {objective.runs} runs, size {violation.size:.4g}: {found.broken}")
    for axis, away in zip(found.box.axes, violation.departure, strict=True):
        print(f"  {axis.key}: {found.values()[axis.key]:.6g} {VARY[axis.key][2]} ({100 * away:.3g} % of the bound)")
    path = folder / "counterexample.yaml"
    path.write_text(trial_text(found.single_runs[-1].built, "Counter-example of the law of the paper."), "utf-8")
    again = run_scenario(read(path))
    same = {name: verdict.robustness for name, verdict in again.facts.requirements.items()} == found.broken
    print(f"{path}: status {again.status.word}, verdict repeated bit for bit: {same}")


def main(
    samples: int = 1000,
    budget: int = 2000,
    duration: float = 10.0,
    share: float | None = None,
    seed: int = 0,
    out: Path | None = None,
) -> None:
    chance = np.random.default_rng(0)
    points, seeds = chance.random((samples, len(VARY))), chance.integers(0, 2**32, samples).tolist()
    begun = time.perf_counter()
    if share is None:
        quiet, loud, there = largest_quiet_box(points, seeds, duration)
        print(f"largest box without a failing sample: share {quiet:.6g} (next tried {loud:.4g}: {there} fail)")
    else:
        quiet = share
        own = failures(evaluator_of(scenario(quiet, duration)), points, seeds)
        print(f"share {quiet:.6g}: {own} of {samples} samples fail")
    text = scenario(quiet, duration)
    for key, (nominal, high, unit) in VARY.items():
        print(f"  {key}: {nominal:g} to {nominal + quiet * (high - nominal):.6g} {unit}")
    fixed = failures(evaluator_of(text), points, None)
    print(f"the same samples, all with the seed of the scenario: {fixed} fail; {time.perf_counter() - begun:.0f} s")
    begun = time.perf_counter()
    found = falsify(text, budget=budget, seed=seed, method="search")
    folder = Path(tempfile.mkdtemp()) if out is None else out
    folder.mkdir(parents=True, exist_ok=True)
    report(found, folder)
    print(f"falsify took {time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--budget", type=int, default=2000)
    parser.add_argument("--duration", type=float, default=10.0)
    parser.add_argument("--share", type=float, help="of the full box; default: the largest without a failing sample")
    parser.add_argument("--seed", type=int, default=0, help="of the search")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    main(arguments.samples, arguments.budget, arguments.duration, arguments.share, arguments.seed, arguments.out)
