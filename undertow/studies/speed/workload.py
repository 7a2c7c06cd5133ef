"""Workload W1: ODIN with the paper's whole motors under the paper's law at 1 kHz for 20 s."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.metrics import Metrics, overall
from undertow.lanes.cuda import Driver
from undertow.loop.in_lanes import Fleet, Plan, Run
from undertow.scenario.build import build
from undertow.studies.paper.setup import scenario

TICKS = 20_000
PLAN = Plan(TICKS, 1e-3, 0, (), "rk4", 1)


def one(precision: str = "float64") -> Run:
    """One run; to be run in the same precision."""
    described = scenario("W1", rung="electromechanical", composite=20.0, loop={"kind": "sampled"})
    loop = build(described | {"precision": precision}).closed_loop
    return Run(loop, (Metrics(10.0, 20.0),), loop.outputs_at_start(None, None), jax.random.PRNGKey(0))


def constant(run: Run) -> list[bool]:
    """Which of its numbers are the same in `several`: all but where they start."""
    same = jax.tree.map(lambda leaf: True, eqx.filter(run, eqx.is_array))
    return jax.tree.leaves(same._replace(start=(False, True)))


def several(run: Run, count: int) -> Any:
    """Numbers of so many runs, from different places."""
    numbers = eqx.filter(run, eqx.is_array)
    stacked = jax.tree.map(lambda leaf: np.broadcast_to(np.asarray(leaf), (count, *leaf.shape)), numbers)
    places = np.random.default_rng(0).normal(scale=0.1, size=(count, *run.start[0].shape))
    return stacked._replace(start=(places.astype(run.start[0].dtype), stacked.start[1]))


def fleet(run: Run, lanes: int = 0, ticks: int = TICKS, driver: Driver | None = None) -> Fleet:
    """The program of W1; arguments as of `Fleet`."""
    return Fleet(run, PLAN._replace(ticks=ticks), constant(run), lanes, driver)


def tracking(accumulated: Any) -> np.ndarray:
    """rms of the error of runs, m and rad."""
    return overall(accumulated[0])["tracking_rms"]


def alone(run: Run) -> Any:
    """Numbers of the run itself."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], eqx.filter(run, eqx.is_array))
