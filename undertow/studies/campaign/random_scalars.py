"""Scalars that the seed of a trial determines: offsets of sensors, factors of a parameter error, which thrusters fail.

They are not stored: a trial is built again, and its random parts are realized from its key.
"""

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PRNGKeyArray, PyTree

from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.core.kept_programs import kept_program
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.part_cache import PartCache
from undertow.scenario.prepare import loop_run
from undertow.scenario.reading import key_path
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.studies.campaign.build_trials import build_trial
from undertow.studies.campaign.trials import Trials

# Trials that are built again, each in milliseconds. The standard error of a rank correlation is then 0.045.
MOST = 500

# A longer array, or one of more dimensions, is a process in time or the components of a sea.
_LONGEST = 16

# Other keys of a trial: an array that is the same for all of them does not depend on the seed.
_OTHERS = range(1, 5)


def realized_scalars(campaign_trials: Trials, rows: Sequence[int]) -> dict[str, np.ndarray]:
    """Scalars that the seed determines, by key path and kind of part: `navigation.sensors[1].offset[0] (dvl)`.

    These are the entries of what disturbance and faults realize and of the state in which the navigation filter starts.
    One that takes both signs, as an offset does, is there by its size as well:
    `|navigation.sensors[1].offset[0]| (dvl)`.

    Args:
        campaign_trials: the trials.
        rows: numbers of valid trials; only the first 500 are built again.

    Returns:
        One value per row: NaN where a trial has no such scalar, or was not built again.
    """
    part_cache = PartCache()
    random = set[str]()
    columns = dict[tuple[str, str], np.ndarray]()
    probes = {*rows[:1], *campaign_trials.representative_trials()}
    with runtime.on_processor(), contextlib.suppress(BadInput):  # a file that the scenario names may be gone by now
        for index, row in enumerate(rows[:MOST]):
            built = build_trial(campaign_trials, part_cache, int(row))
            if row in probes:
                random |= _random(built)
            elif not random:  # no part of the scenario is random
                break
            for name, values in _realized(built).items() if random else ():
                for i, value in enumerate(np.atleast_1d(values) if name in random else ()):
                    entry = f"{name}[{i}]" if values.ndim else name, _kind(built.resolved, name)
                    columns.setdefault(entry, np.full(len(rows), np.nan))[index] = value
    return {name: column for entry, values in columns.items() for name, column in _signed_and_size(*entry, values)}


def _signed_and_size(name: str, kind: str, values: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    yield f"{name} ({kind})", values
    if np.nanmin(values) < 0 < np.nanmax(values):
        yield f"|{name}| ({kind})", np.abs(values)


def _random(built: Built) -> set[str]:
    """Names of the arrays that depend on the seed."""
    if not _realized(built, trace=True):  # which takes no compiling
        return set()
    scalars = _realized(built)
    of_other_seeds = [_realized(built, number) for number in _OTHERS]
    differs = lambda name: any((scalars[name] != realization[name]).any() for realization in of_other_seeds)
    return {name for name in scalars if differs(name)}


@in_its_precision
def _realized(built: Built, seed_number: int = 0, trace: bool = False) -> dict[str, Any]:
    """Short arrays of the realization, by key path; those of another seed where a number is given; or their shapes."""
    run = loop_run(built)
    key = jax.random.fold_in(run.key, seed_number) if seed_number else run.key
    tree = eqx.filter_eval_shape(_start, run.loop, run.start, key) if trace else _compiled(run.loop, run.start, key)
    leaves = jax.tree_util.tree_flatten_with_path(tree)[0]
    short = lambda leaf: (
        hasattr(leaf, "dtype")  # a constant that is a plain number has none
        and jnp.issubdtype(leaf.dtype, jnp.floating)
        and leaf.ndim <= 1
        and leaf.size <= _LONGEST
    )
    return {_name(path): leaf if trace else np.asarray(leaf) for path, leaf in leaves if short(leaf)}


def _start(loop: ClosedLoop, start: tuple[Any, Any], key: PRNGKeyArray) -> dict[str, PyTree]:
    """What the disturbance and the faults realize, and the state in which the navigation filter starts."""
    realization = loop.realize(key)
    truth = loop.plant.output(jnp.zeros(()), loop.plant.initial_state(*start))
    navigation = loop.navigation.init(realization.navigation_realization, truth)
    faults = {} if loop.faults is None else loop.faults.sampled(realization.faults_realization)
    return {"disturbance": realization.disturbance_realization, "navigation": navigation, "faults": faults}


_compiled = kept_program(_start)


def _name(path: tuple[Any, ...]) -> str:
    """A path in a tree as key paths of scenarios are written."""
    steps = (getattr(step, "name", getattr(step, "key", getattr(step, "idx", None))) for step in path)
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps).removeprefix(".")


def _kind(resolved: Any, name: str) -> str:
    """Kind of the innermost part on a key path, or mode of a fault; of a part in a file, the name of its function."""
    kind = ""
    for step in key_path(name):
        try:
            resolved = resolved[step]
        except (KeyError, IndexError, TypeError):
            break
        kind = resolved.get("kind", resolved.get("mode", kind)) if isinstance(resolved, dict) else kind
    return kind.rpartition(":")[2]
