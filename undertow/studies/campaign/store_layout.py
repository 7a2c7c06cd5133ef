"""Layout of a results store: an axis for every key of `cross`, and one for the samples; a block is a task."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from undertow.studies.campaign.campaign_schema import Campaign

SAMPLES = "sample"

# Tasks, where nothing is known of who runs them.
TASKS = 100


class StoreLayout(NamedTuple):
    """Axes of the store, cut into blocks."""

    swept: tuple[int, ...]  # number of values of every key of `cross`
    samples: int
    chunk: tuple[int, ...]  # size of a block along every axis, that of the samples last

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the whole."""
        return (*self.swept, self.samples)

    @property
    def blocks(self) -> tuple[int, ...]:
        """How many there are along every axis."""
        return tuple(-(-size // step) for size, step in zip(self.shape, self.chunk, strict=True))

    @property
    def tasks(self) -> int:
        """How many blocks there are."""
        return math.prod(self.blocks)

    def block(self, task: int) -> tuple[int, ...]:
        """Index of the block of a task. Tasks of the first samples come first, so that new samples are new tasks."""
        sample, *swept = np.unravel_index(task, (self.blocks[-1], *self.blocks[:-1]))
        return (*map(int, swept), int(sample))

    def region(self, task: int) -> tuple[slice, ...]:
        """What the block of a task covers."""
        axes = zip(self.block(task), self.chunk, self.shape, strict=True)
        return tuple(slice(i * step, min((i + 1) * step, size)) for i, step, size in axes)

    def count(self, task: int) -> int:
        """Trials of a task."""
        return math.prod(span.stop - span.start for span in self.region(task))

    def trials(self, task: int) -> Int[np.ndarray, " trials"]:
        """Numbers of the trials of a task, in the order of its block."""
        *swept, samples = self.region(task)
        combinations = np.arange(math.prod(self.swept)).reshape(self.swept)
        numbers = np.arange(samples.start, samples.stop) * combinations.size
        return (combinations[(*swept, None)] + numbers).reshape(-1)

    def partial(self) -> range:
        """Tasks that would contain more trials if there were more samples."""
        beside = math.prod(self.blocks[:-1])
        return range(self.samples // self.chunk[-1] * beside, self.tasks)


def layout(campaign: Campaign, tasks: int = TASKS) -> StoreLayout:
    """Layout of a new store: about so many trials per task as the campaign asks, preferably along the samples.

    Args:
        campaign: whose trials it holds.
        tasks: how many of them, where the campaign does not say how many trials each has.
    """
    swept = tuple(len(entries) for entries in campaign.axes.values())
    most = campaign.trials_per_task(tasks)
    chunk = [min(most, max(campaign.trials, most // math.prod(swept)))]
    for count in reversed(swept):
        chunk.insert(0, min(count, most // math.prod(chunk)) or 1)
    return StoreLayout(swept, campaign.trials, tuple(chunk))
