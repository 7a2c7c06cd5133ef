"""The numbers and the plan of a trial."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np

from undertow.analysis.metrics import accumulators
from undertow.campaign.campaign_schema import Series
from undertow.loop.simd_batch import Plan, Run
from undertow.numerics.random_keys import key_of_seed
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.part_cache import structure

_STARTS = ("position", "velocity")


@in_its_precision
def run_of(built: Built) -> Run:
    """Loop, accumulators, start and key of a trial."""
    scenario = built.scenario
    start = built.closed_loop.outputs_at_start(*(getattr(scenario.initial, name) for name in _STARTS))
    gathered = accumulators(built.closed_loop.plant, built.metrics, *built.window())
    return Run(built.closed_loop, gathered, start, key_of_seed(scenario.seed))


def planned(built: Built, asked: Series | None) -> Plan:
    """Steps and recorded series of a trial."""
    loop = built.scenario.loop
    every, signals = (round(asked.every / loop.dt), tuple(asked.signals)) if asked else (0, ())
    return Plan(round(loop.duration / loop.dt), loop.dt, every, signals, loop.method, loop.substeps)


def leaves(run: Run) -> list[Any]:
    """The numbers of a trial, in the order of its tree."""
    return [leaf for leaf in jax.tree.leaves(run) if eqx.is_array(leaf)]


def shared_numbers(several: Sequence[Built]) -> dict[Any, list[np.ndarray | None]]:
    """Numbers that are equal in all trials of a structure with at least two trials; None for the others."""
    probes: dict[Any, list[list[Any]]] = {}
    for built in several:
        run = run_of(built)
        probes.setdefault(structure(run), []).append(leaves(run))
    same = lambda column: all(np.array_equal(column[0], other) for other in column[1:])
    return {
        form: [column[0] if same(column) else None for column in zip(*members, strict=True)]
        for form, members in probes.items()
        if len(members) > 1
    }
