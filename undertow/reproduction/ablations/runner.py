"""All seeds of a variant in one compiled program, with statistics only."""

from typing import Any

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import Metrics, results
from undertow.core.status import Status
from undertow.loop import sampled
from undertow.loop.closed_loop import ClosedLoop
from undertow.reproduction.ablations.ablation import Schedule
from undertow.reproduction.all_outputs import with_all_outputs

# Two families of seeds that have none in common: gains are sought on one and reported on the other.
TRAINING, HELD_OUT = 1, 2

# Names of what is kept of each run. There are also `share`, the rms error of the estimate over the rms of d, and
# `lost_axes`, the number of axes that are not held.
METRICS = (
    "tracking_rms",
    "estimation_rms",
    "uncertainty_rms",
    "input_rms",
    "input_variation",
    "weights_peak",
    "saturated_fraction",
)

_HELD = 0.1  # m, rad


def keys(family: int, seeds: int):
    """Keys of so many seeds of a family."""
    return jax.random.split(jax.random.PRNGKey(family), seeds)


def run(loop: ClosedLoop, schedule: Schedule, seeds, family: int = HELD_OUT) -> dict[str, np.ndarray]:
    """Metrics of the second half of each run, an infinite value where a run ended early.

    Args:
        loop: what is run; loops that differ in numbers only share a program.
        schedule: duration and sampling.
        seeds: how many.
        family: TRAINING or HELD_OUT.

    Returns:
        Name -> one value per seed, `share`, `lost_axes` and the `status` codes among them.
    """
    last = float(np.nextafter(schedule.duration, 0.0))
    window = Metrics(schedule.duration / 2, last, loop.plant.output_units)
    states, status = jax.tree.map(np.asarray, _program(loop, window, keys(family, seeds), tuple(schedule)))
    one_of = lambda i: results((window,), (jax.tree.map(lambda leaf: leaf[i], states),))
    each = [with_all_outputs(one_of(i)) for i in range(seeds)]
    lasted = status == int(Status.OK)
    kept = {name: np.where(lasted, [one.get(name, np.nan) for one in each], np.inf) for name in METRICS}
    axes = np.array([one["error_rms_axes"] for one in each])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(lasted, kept["estimation_rms"] / kept["uncertainty_rms"], np.inf)
    return kept | {"share": share, "lost_axes": np.where(lasted, (axes > _HELD).sum(1), np.inf), "status": status}


@eqx.filter_jit
def _program(loop: ClosedLoop, window: Metrics, keys, schedule: tuple[float, float, int]) -> Any:
    """One seed after the other: as fast as side by side on a processor, and compiled in half the time."""
    duration, dt, substeps = schedule

    def one(key):
        outcome = sampled.simulate(
            loop, duration=duration, dt=dt, key=key, record_every=0, accumulators=(window,), substeps=substeps
        )
        return outcome.accumulated[0], outcome.status

    return jax.lax.map(one, keys)
