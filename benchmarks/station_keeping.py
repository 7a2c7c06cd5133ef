"""Station keeping of BlueROV2 Heavy at sea: preset `robust` against a PID tuned with the same budget.

T200s at 16 V, 100 Hz, JONSWAP Hs 0.5 m at 3 m depth, current 0.5 m/s, the vehicle's own sensors. The nominal
model has one published parameter set; every set is the true plant in turn.

    python benchmarks/station_keeping.py [--seeds 100] [--budget 240] [--laws pid,robust] [--fix-noise 0.05]

The default position fixes (5 cm, every second, 0.2 s late) limit any controller by the error of its navigation, which
is printed, too. `--fix-noise 0.005` has fixes of 5 mm, ten per second with a delay of 10 ms, so that the noise of DVL,
IMU, depth and compass remains; `--fix-noise 0` has exact positions and velocities.
"""

import argparse
import copy
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.scenario.schema import TrainingRuns
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.sampled import AbstractAccumulator
from undertow.studies.tuning.training_runs import trials
from undertow.studies.tuning.tune import tune

jax.config.update("jax_enable_x64", True)

SETS = ["vonbenzon2022", "wu2018", "ng2024", "gazebo_box_drag", "px4"]
DURATION, START = 60.0, 30.0  # s
SEA = {
    "plant": {
        "vehicle": {"kind": "bluerov2_heavy", "parameters": SETS[0]},
        "thruster": {"kind": "t200", "supply": 16.0},
        "ledger": False,
    },
    "model": {"rate_term": True},
    "reference": {"kind": "setpoint", "position": [0.0] * 6},
    "disturbance": [{"kind": "current", "velocity": [0.4, 0.3, 0.0]}, {"kind": "waves", "height": 0.5, "depth": 3.0}],
    "navigation": {"kind": "observer"},
    "loop": {"dt": 0.01, "duration": DURATION, "record": 0.05},
    "tune": {
        "duration": 20.0,
        "start": 8.0,
        "train": {"sets": SETS, "seeds": 1, "sizes": [1.0]},
        "held_out": {"sets": SETS, "seeds": 1, "sizes": [1.0]},
        "weights": {"tracking": 1.0, "effort": 0.0, "variation": 0.01},
    },
}
LAWS = {
    "pid": {"kind": "pid"},
    "pid_computed": {"kind": "pid", "motor": "computed"},
    "robust": {"kind": "rcaf", "preset": "robust"},
}
FIRST_SEED = 10_000  # different from those of tuning


class Sums(NamedTuple):
    samples: jax.Array
    error: jax.Array
    navigation: jax.Array
    control: jax.Array
    variation: jax.Array
    last: jax.Array


class Station(AbstractAccumulator):
    """Squares of the error, of the error of navigation, and of the measured error; variation of the voltage."""

    def init(self, signals):
        zero = jnp.zeros_like(signals["error"])
        return Sums(jnp.zeros(()), zero, zero, zero, jnp.zeros(()), signals["input"])

    def update(self, state, t, signals):
        inside = jnp.where(t >= START, 1.0, 0.0)
        return Sums(
            state.samples + inside,
            state.error + inside * signals["error"] ** 2,
            state.navigation + inside * (signals["measured_position"] - signals["position"]) ** 2,
            state.control + inside * (signals["reference"] - signals["measured_position"]) ** 2,
            state.variation + inside * jnp.abs(signals["input"] - state.last).mean(),
            signals["input"],
        )


def run_all(scenario, seeds):
    """Per run, rms of each axis: error, error of navigation, measured error; variation, completion; plant variant."""
    text = from_data(scenario)
    built = build(text)
    runs = TrainingRuns.model_validate({"seeds": seeds, "sizes": [1.0], "sets": SETS})
    loop, several = built.closed_loop, trials(text, built, runs, (), "train", FIRST_SEED)

    def run(plant, key):
        whole = ClosedLoop(plant, loop.controller, loop.reference, loop.disturbance, loop.navigation)
        found = sampled.simulate(whole, duration=DURATION, dt=0.01, key=key, record_every=0, accumulators=(Station(),))
        sums = found.accumulated[0]
        rms = lambda squares: jnp.sqrt(squares / sums.samples)
        signals = (rms(signal) for signal in (sums.error, sums.navigation, sums.control))
        return *signals, sums.variation / (DURATION - START), found.status == 0

    together, pieces, chunk = None, [], min(25, several.number)
    rest = eqx.filter(several.plants, eqx.is_array, inverse=True)
    batch = jax.jit(jax.vmap(lambda plant, key: run(eqx.combine(plant, rest), key)))
    for i in range(0, several.number, chunk):
        part = several.part(np.minimum(np.arange(i, i + chunk), several.number - 1))
        arguments = (eqx.filter(part.plants, eqx.is_array), part.keys)
        if together is None:
            together = batch.lower(*arguments).compile(compiler_options={"xla_backend_optimization_level": "1"})
        pieces.append(jax.tree.map(np.asarray, together(*arguments)))
    return [np.concatenate(each)[: several.number] for each in zip(*pieces, strict=True)], np.array(several.variants)


def at_sea(name, fix_noise):
    """The scenario with an untuned law."""
    if fix_noise == 0:
        return {**copy.deepcopy(SEA), "controller": LAWS[name], "navigation": {"kind": "perfect"}}
    fix = {"kind": "position_fix", "noise": fix_noise}
    if fix_noise != 0.05:
        fix |= {"period": 0.1, "delay": 0.01}
    sensors = ["imu", "dvl", "depth", "compass", fix]
    return {**copy.deepcopy(SEA), "controller": LAWS[name], "navigation": {"kind": "observer", "sensors": sensors}}


def tuned(name, scenario, budget):
    """The scenario with tuned gains."""
    with tempfile.TemporaryDirectory() as folder:
        found = tune(from_data(scenario), Path(folder) / "checkpoint", budget=budget)
    best = found.evaluated[-1]
    print(
        f"{name}: tuned in {found.elapsed:.0f} s, {found.evaluations} gains, training cost {best.train_cost:.4g}, "
        f"held out {best.held_out_cost:.4g}, spectral radius {best.certificate.worst:.5f}\n  {best.options}",
        flush=True,
    )
    return found.scenario


def report(title, runs):
    (error, navigation, control, variation, lasted), variants = runs
    print(f"\n{title}: {lasted.mean():.1%} of {len(lasted)} runs completed; medians [5 %, 95 %] of rms over seeds")
    print(f"  {'plant':<18}{'position, cm':>22}{'attitude, mrad':>24}{'navigation, cm':>16}{'measured':>12}{'V/s':>8}")
    rms = lambda squares: np.sqrt((squares**2).mean(axis=-1))
    cut = lambda values: (
        f"{np.median(values):7.2f} [{np.quantile(values, 0.05):5.2f}, {np.quantile(values, 0.95):5.2f}]"
    )
    for name in [*SETS, "all"]:
        of = (variants == name) | (name == "all")
        place, turned = 100 * rms(error[of][:, :3]), 1000 * rms(error[of][:, 3:])
        own, left = (np.median(100 * rms(each[of][:, :3])) for each in (navigation, control))
        print(f"  {name:<18}{cut(place):>22}{cut(turned):>24}{own:>16.2f}{left:>12.2f}{np.median(variation[of]):>8.1f}")
    return error


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--budget", type=float, default=240.0)
    parser.add_argument("--laws", default="pid,robust")
    parser.add_argument("--fix-noise", type=float, default=0.05)
    options = parser.parse_args()
    errors = {}
    for name in options.laws.split(","):
        begun = time.perf_counter()
        scenario = tuned(name, at_sea(name, options.fix_noise), options.budget)
        errors[name] = report(name, run_all(scenario, options.seeds))
        print(f"  ({time.perf_counter() - begun:.0f} s)", flush=True)
    first, *others = errors
    whole = lambda name, axes: np.sqrt((errors[name][:, axes] ** 2).mean())
    for name in others:
        kinds = {"position": slice(0, 3), "attitude": slice(3, 6), "all six axes": slice(0, 6)}
        ratios = ", ".join(f"{kind} {whole(first, axes) / whole(name, axes):.2f}" for kind, axes in kinds.items())
        print(f"\n{first} / {name}, rms over all runs: {ratios}")


if __name__ == "__main__":
    main()
