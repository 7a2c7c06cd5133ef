"""Replays of chosen trials of a campaign or a comparison: these keep no series, so the trials are run again."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from undertow.campaign.batch_runner import BatchResult, ProgramCache, batch_of, planned
from undertow.campaign.campaign_schema import Series
from undertow.core import runtime
from undertow.loop.dataset import to_dataset
from undertow.loop.outcome import Outcome
from undertow.report.replay.replay_data import COLOURS, FRAMES, Replay, replay_of
from undertow.report.replay.replay_section import not_made
from undertow.scenario.build import Built
from undertow.simulation.run_facts import hull_of

MOST = len(COLOURS)  # vehicles in one scene, each in a colour of its own


def replays_of_trials(trials: Mapping[str, Built]) -> tuple[list[Replay], list[str]]:
    """Run trials again and return what a replay shows of them, and a sentence for each failure.

    Trials of one structure share a compiled program; compiling takes most of the time.

    Args:
        trials: label -> trial of a vehicle with thrusters.
    """
    alike: dict[tuple[tuple[str, ...], float], dict[str, Built]] = {}
    for label, built in trials.items():
        kind = (tuple(built.closed_loop.signals()), _time_between_records(built))
        alike.setdefault(kind, {})[label] = built
    found: dict[str, Replay] = {}
    failures: list[str] = []
    for (signals, every), several in alike.items():
        try:
            with runtime.on_processor():
                found |= _together(several, Series(signals=list(signals), every=every))
        except Exception as error:  # a user's part may run and yet not be differentiable
            failures.append(not_made(error, f" of {', '.join(several)}"))
    return [found[label] for label in trials if label in found], failures


def _together(trials: Mapping[str, Built], recorded: Series) -> dict[str, Replay]:
    several = list(trials.values())
    result = ProgramCache(lambda: several).run([batch_of(built, recorded) for built in several], recorded)
    replays = {
        label: replay_of(
            _dataset(built, result, place, recorded),
            built.closed_loop,
            built.scenario.seed,
            hull_of(built.resolved),
            label,
        )
        for place, (label, built) in enumerate(trials.items())
    }
    return {label: replay for label, replay in replays.items() if replay is not None}


def _time_between_records(built: Built) -> float:
    """As in the scenario, but no more records than a replay shows; s."""
    loop = built.scenario.loop
    return loop.dt * max(round(loop.record / loop.dt), int(np.ceil(loop.duration / loop.dt / FRAMES - 1e-6)))


def _dataset(built: Built, result: BatchResult, place: int, recorded: Series) -> xr.Dataset:
    """The dataset of one trial of a batch."""
    loop = built.closed_loop
    time: Any = planned(built, recorded).times()
    signals = {name: values[place] for name, values in result.series.items()}
    ending: tuple[Any, ...] = (result.status[place], result.ended[place], 0)  # input 0: which one failed is not kept
    return to_dataset(Outcome(time, signals, (), (), *ending), loop)
