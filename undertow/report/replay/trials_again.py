"""Replays of chosen trials of a campaign or a comparison: these keep no series, so the trials are run again."""

from collections.abc import Mapping, Sequence

import numpy as np

from undertow.report.replay.replay_data import COLOURS, FRAMES, ReplayData, replay_of
from undertow.report.replay.replay_section import not_made
from undertow.scenario.build import Built
from undertow.scenario.prepare import prepare
from undertow.scenario.results.run_facts import hull_of
from undertow.simulation.loop.dataset import to_dataset
from undertow.simulation.run_many import run_many

MOST = len(COLOURS)  # vehicles in one scene, each in a colour of its own


def replays_of_trials(trials: Mapping[str, Built]) -> tuple[list[ReplayData], list[str]]:
    """Run trials again and return what a replay shows of them, and a sentence for each failure.

    Trials of one structure share a compiled program; compiling takes most of the time.

    Args:
        trials: label -> trial of a vehicle with thrusters.
    """
    groups: dict[tuple[tuple[str, ...], float], dict[str, Built]] = {}
    for label, built in trials.items():
        kind = (tuple(built.closed_loop.signals()), _time_between_records(built))
        groups.setdefault(kind, {})[label] = built
    replays: dict[str, ReplayData] = {}
    failures: list[str] = []
    for (signals, every), trials_of_group in groups.items():
        try:
            replays |= _together(trials_of_group, signals, every)
        except Exception as error:  # a user's part may run and yet not be differentiable
            failures.append(not_made(error, f" of {', '.join(trials_of_group)}"))
    return [replays[label] for label in trials if label in replays], failures


def _together(trials: Mapping[str, Built], signals: Sequence[str], every: float) -> dict[str, ReplayData]:
    replays: dict[str, ReplayData] = {}
    labels = list(trials)
    for batch in run_many(prepare(built, signals, every) for built in trials.values()):
        for index, outcome in batch.each():
            label = labels[index]
            built = trials[label]
            dataset = to_dataset(outcome, built.closed_loop)
            replay = replay_of(dataset, built.closed_loop, built.scenario.seed, hull_of(built.resolved), label)
            if replay is not None:
                replays[label] = replay
    return replays


def _time_between_records(built: Built) -> float:
    """As in the scenario, but no more records than a replay shows; s."""
    loop = built.scenario.loop
    return loop.dt * max(round(loop.record / loop.dt), int(np.ceil(loop.duration / loop.dt / FRAMES - 1e-6)))
