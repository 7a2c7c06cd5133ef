"""What a memory gives: preset `learning` against `robust`, with fuzzy rules, with v and v |v|, and with both.

BlueROV2 Heavy, T200s at 16 V. The true vehicle has the parameters vonbenzon2022, the nominal model another published
set. All laws have the same gains, those of preset `robust`. Motions are repeated; errors are those from the second
lap to the end. `current` is still water with a current, `waves` JONSWAP waves with it, `navigation` still water with
navigation from readings. Rates of inputs are counted at every control step, errors ten times per second.

    python benchmarks/learning.py [--seeds 6] [--first 2000] [--laps 2] [--motions lissajous,lawn_mower,six_axis]
        [--models wu2018,px4] [--rates 50,100] [--seas still,current,waves,navigation] [--laws both,rules,linear]
        [--height 0.25] [--depth 3] [--current 0.15 0.1] [--probing 0] [--long] [--next-dive]

Seeds are `first`, `first` + 1, ...; still water needs one. `worst` is the largest ratio of a seed. `--long` runs the
first motion for 2,000 s more and compares its last lap with the second. `--next-dive` saves what was learnt in three
laps, loads it and reports the first lap of the next run, without its first 20 s: the lissajous and the six-axis motion
begin with a jump of the velocity, which costs every law the same. Both are in still water at 50 Hz.
"""

import argparse
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from undertow.analysis.metrics import Metrics
from undertow.control.controllers.law_signals import INERTIA
from undertow.control.controllers.robust.knowledge import save_knowledge
from undertow.control.references.lawn_mower import lawn_mower
from undertow.control.references.lissajous import lissajous
from undertow.core.contracts import AbstractReference, Target
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.loop import simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.dataset import to_dataset
from undertow.simulation.loop.loop_runs import RunPlan
from undertow.simulation.prepared_run import prepare_loop
from undertow.simulation.run_many import run_together

jax.config.update("jax_enable_x64", True)

PATHS = {"still": {}, "current": {}, "waves": {}, "navigation": {"navigation": {"kind": "observer"}}}
START = 20.0  # s
_FAR = 1.0  # m
SEA = [{"kind": "current", "velocity": [0.15, 0.1, 0.0]}, {"kind": "waves", "height": 0.25, "depth": 3.0}]
LAWS = {
    "robust": {"preset": "robust"},
    "both": {"preset": "learning"},
    "rules": {"preset": "learning", "regressor": "rules"},
    "linear": {"preset": "learning", "regressor": "linear"},
}
PROBING = "acceleration of the probing oscillation, m/s^2 and rad/s^2; 0 for none"


def set_probing(options) -> None:
    """Give the chosen laws the option `probing`, where it is asked for."""
    if options.probing is not None:
        for law in options.laws.split(","):
            LAWS[law]["probing"] = options.probing


class ThereAndBack(AbstractReference):
    """A path from rest to rest, run forwards and backwards again and again."""

    path: AbstractReference
    duration: jax.Array

    def at(self, t) -> Target:
        phase = jnp.mod(t, 2 * self.duration)
        back = phase > self.duration
        there = self.path.at(jnp.where(back, 2 * self.duration - phase, phase))
        return there._replace(velocity=jnp.where(back, -1.0, 1.0) * there.velocity)


class SixAxes(AbstractReference):
    """A sinusoid on each of the six outputs."""

    amplitude: jax.Array
    frequency: jax.Array

    def at(self, t) -> Target:
        angle = self.frequency * t
        wave = self.amplitude * jnp.sin(angle)
        return Target(wave, self.amplitude * self.frequency * jnp.cos(angle), -(self.frequency**2) * wave)


def motions() -> dict[str, tuple[AbstractReference, float]]:
    """Reference and duration of a lap, s."""
    lap = 40 * np.pi
    survey = lawn_mower(length=8.0, spacing=2.0, count=3, speed=0.4, ramp=4.0)
    once = float((3 * 8.0 + 2 * np.pi) / 0.4 + 4.0 + 2.0)
    amplitude = jnp.asarray([1.5, 1.0, 0.5, 0.3, 0.3, 0.8])
    return {
        "lissajous": (lissajous([2.0, 1.0, 0.5, 0.8], [0.2, 0.4, 0.3, 0.25]), lap),
        "lawn_mower": (ThereAndBack(survey, jnp.asarray(once)), 2 * once),
        "six_axis": (SixAxes(amplitude, jnp.asarray([0.25, 0.35, 0.5, 0.4, 0.45, 0.3])), lap),
    }


def loop_of(law: dict[str, Any], motion: AbstractReference, model: str, rate: int, sea: str) -> ClosedLoop:
    """The closed loop of one case."""
    scenario = {
        "plant": {
            "vehicle": {"kind": "bluerov2_heavy", "parameters": "vonbenzon2022"},
            "thruster": {"kind": "t200", "supply": 16.0},
            "ledger": False,
        },
        "model": {"rate_term": True, "vehicle": {"kind": "bluerov2_heavy", "parameters": model}},
        "controller": {"kind": "rcaf"} | law,
        "reference": {"kind": "setpoint", "position": [0.0] * 6},
        "disturbance": {"waves": SEA, "current": SEA[:1]}.get(sea, []),
        "loop": {"dt": 1 / rate, "duration": 1.0, "record": 0.1},
    } | PATHS[sea]
    if not scenario["disturbance"]:
        del scenario["disturbance"]
    loop = build(from_data(scenario)).closed_loop
    return eqx.tree_at(lambda one: one.reference, loop, motion)


def run(loop: ClosedLoop, rate: int, duration: float, seed: int):
    """A run by the batch compiler, recorded ten times per second."""
    key = jax.random.PRNGKey(seed)
    return simd_batch.simulate(loop, duration=duration, dt=1 / rate, key=key, record_every=rate // 10)


def errors(found, start: float, stop: float) -> np.ndarray:
    """Rms error of position, m, and attitude, rad, and mean size of the change of an input from record to record, V."""
    time = np.asarray(found.time)
    inside = (time > start) & (time <= stop)
    off = np.asarray(found.signals["error"])[inside]
    changes = np.abs(np.diff(np.asarray(found.signals["input"])[inside], axis=0)).mean()
    return np.array([*(np.sqrt((off[:, part] ** 2).sum(1).mean()) for part in (slice(3), slice(3, 6))), changes])


class Found(NamedTuple):
    """Errors of runs with different seeds.

    Attributes:
        errors: (seeds, 3): rms error of position, m, and angle of rotation to the reference, rad, from ten records
            per second, and variation of an input, V/s, from every control step.
        lost: how many runs did not reach their end, or have a position error of more than 1 m rms.
        laps: rms error of position and attitude over each lap, (seeds, laps, 2).
        navigation: rms error of the measured position and attitude, (seeds, 2).
        final: values of the recorded signals at the end, by name.
    """

    errors: np.ndarray
    lost: int
    laps: np.ndarray
    navigation: np.ndarray
    final: dict[str, np.ndarray]


def run_seeds(
    loop: ClosedLoop, rate: int, duration: float, seeds: Iterable[int], start: float, stop: float, lap: float = np.inf
) -> Found:
    """Runs of one loop with different seeds, as one SIMD batch; errors over start < t <= stop, s."""
    metrics = Metrics(start, stop, loop.plant.output_units)
    names = ("position", "reference", "measured_position", "memory_weights", "memory_variance", *INERTIA)
    signals = tuple(name for name in names if name in loop.signals())
    plan = RunPlan(round(duration * rate), 1 / rate, rate // 10, signals)
    runs = [prepare_loop(loop, plan, seed, (metrics,)) for seed in seeds]
    outcome = run_together(runs)
    state = jax.tree.map(np.asarray, outcome.accumulated[0])
    time, series = np.asarray(outcome.time)[0], outcome.signals
    off = np.stack(errors_of(series["reference"], series["position"]), -1)
    known = np.stack(errors_of(series["measured_position"], series["position"]), -1)
    rms = lambda values, begin, end: np.sqrt((values[:, (time > begin) & (time <= end)] ** 2).mean(1))
    laps = [rms(off, k * lap, (k + 1) * lap) for k in range(int(duration / lap + 1e-6))]
    return Found(
        np.concatenate([rms(off, start, stop), (state.variation / state.span)[:, None]], 1),
        int(((np.asarray(outcome.status) != 0) | (rms(off, start, stop)[:, 0] > _FAR)).sum()),
        np.stack(laps, 1) if laps else np.zeros((len(runs), 0, 2)),
        rms(known, start, stop),
        {name: np.asarray(series[name])[:, -1] for name in signals},
    )


def errors_of(target, outputs) -> tuple[np.ndarray, np.ndarray]:
    """Distance, m, and angle of the rotation between two attitudes, rad; both of a vehicle's six outputs."""
    target, outputs = np.asarray(target), np.asarray(outputs)
    there, here = (Rotation.from_euler("ZYX", one[..., :2:-1].reshape(-1, 3)) for one in (target, outputs))
    angle = (here.inv() * there).magnitude().reshape(target.shape[:-1])
    return np.linalg.norm(target[..., :3] - outputs[..., :3], axis=-1), angle


def compared(options) -> None:
    """Print the table of all cases."""
    print(f"{'motion':<11}{'model':<8}{'Hz':>4} {'sea':<11}{'law':<8}medians over seeds; ratios to robust")
    for name in options.motions.split(","):
        motion, lap = motions()[name]
        duration = np.round(options.laps * lap)
        for rate in map(int, options.rates.split(",")):
            for sea in options.seas.split(","):
                for model in options.models.split(","):
                    base = None
                    for law in ("robust", *options.laws.split(",")):
                        loop = loop_of(LAWS[law], motion, model, rate, sea)
                        seeds = range(
                            options.first, options.first + (1 if sea in ("still", "current") else options.seeds)
                        )
                        found = run_seeds(loop, rate, duration, seeds, lap, duration)
                        base = found.errors if base is None else base
                        value, ratio = np.median(found.errors, axis=0), found.errors / base
                        print(
                            f"{name:<11}{model:<8}{rate:>4} {sea:<11}{law:<8}{1e3 * value[0]:12.1f} mm"
                            f"{1e3 * value[1]:9.1f} mrad{value[2]:8.2f} V/s   ratios, median"
                            + "".join(f"{one:6.2f}" for one in np.median(ratio, axis=0))
                            + "  worst"
                            + "".join(f"{one:6.2f}" for one in ratio.max(0))
                            + (
                                f"  measured to {1e3 * np.median(found.navigation[:, 0]):.1f} mm"
                                * (sea == "navigation")
                            )
                            + (f"  {found.lost} of {len(seeds)} lost" if found.lost else ""),
                            flush=True,
                        )


def long_run(options) -> None:
    """The second lap and the last one after 2,000 s more."""
    name = options.motions.split(",")[0]
    motion, lap = motions()[name]
    for model in options.models.split(","):
        for law in options.laws.split(","):
            loop = loop_of(LAWS[law], motion, model, 50, "still")
            end = np.round(2 * lap + 2000)
            found = run(loop, 50, end, 0)
            second, last = errors(found, lap, 2 * lap), errors(found, end - lap, end)
            print(
                f"{name} {model} {law}: second lap {1e3 * second[0]:.2f} mm, {1e3 * second[1]:.2f} mrad; "
                f"2,000 s later {1e3 * last[0]:.2f} mm, {1e3 * last[1]:.2f} mrad; largest weight "
                f"{np.abs(found.signals['memory_weights'][-1]).max():.2f}"
            )


def next_dive(options) -> None:
    """First lap with what was learnt before."""
    for name in options.motions.split(","):
        motion, lap = motions()[name]
        for model in options.models.split(","):
            first = errors(run(loop_of(LAWS["robust"], motion, model, 50, "still"), 50, np.round(lap), 0), START, lap)
            for law in options.laws.split(","):
                loop = loop_of(LAWS[law], motion, model, 50, "still")
                learnt = run(loop, 50, np.round(3 * lap), 0)
                with tempfile.TemporaryDirectory() as folder:
                    path = Path(folder) / "learnt.npz"
                    save_knowledge(path, to_dataset(learnt, loop))
                    again = loop_of(LAWS[law] | {"knowledge": str(path)}, motion, model, 50, "still")
                value = errors(run(again, 50, np.round(lap), 0), START, lap)
                print(
                    f"{name} {model} {law}: first lap of the next dive {1e3 * value[0]:.1f} mm, "
                    f"{1e3 * value[1]:.1f} mrad; ratios to robust {value[0] / first[0]:.2f}, {value[1] / first[1]:.2f}"
                )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first", type=int, default=2000)
    parser.add_argument("--laps", type=int, default=2)
    parser.add_argument("--motions", default="lissajous,lawn_mower,six_axis")
    parser.add_argument("--models", default="wu2018,px4")
    parser.add_argument("--rates", default="50,100")
    parser.add_argument("--seas", default="still,current,waves,navigation")
    parser.add_argument("--laws", default="both,linear")
    parser.add_argument("--height", type=float, default=0.25)
    parser.add_argument("--depth", type=float, default=3.0)
    parser.add_argument("--current", type=float, nargs=2, default=(0.15, 0.1))
    parser.add_argument("--probing", type=float, help=PROBING)
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--next-dive", action="store_true")
    chosen = parser.parse_args()
    SEA[:] = [
        {"kind": "current", "velocity": [*chosen.current, 0.0]},
        {"kind": "waves", "height": chosen.height, "depth": chosen.depth},
    ]
    set_probing(chosen)
    if chosen.long:
        long_run(chosen)
    elif chosen.next_dive:
        next_dive(chosen)
    else:
        compared(chosen)
