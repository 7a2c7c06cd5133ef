"""Option `--replay` of the commands that run many trials: a replay of some of them on the page."""

from collections.abc import Mapping, Sequence
from itertools import islice

from rich.console import Console

from undertow.cli.interruptible import interruptible
from undertow.cli.stages import stage
from undertow.core.errors import BadInput
from undertow.report.replay.replay_data import ReplayData, can_be_shown
from undertow.report.replay.trials_again import MOST, replays_of_trials
from undertow.scenario.build import Built


def check_replay(trials: Sequence[Built]) -> None:
    """Check before anything is run that a replay can show the trials.

    Raises:
        BadInput: a plant is no vehicle with thrusters.
    """
    if not all(can_be_shown(built.closed_loop.plant) for built in trials):
        raise BadInput("--replay", "be left out for a plant that is no vehicle with thrusters", "given")


def run_again(console: Console, trials: Mapping[str, Built]) -> tuple[list[ReplayData], list[str]]:
    """Replays of trials, label -> trial, of which the first four are run again; and a sentence for each failure."""
    first_trials = dict(islice(trials.items(), MOST))
    if not first_trials:
        return [], []
    with stage(console, f"replay: running {len(first_trials)} again"):
        return interruptible(lambda: replays_of_trials(first_trials))
