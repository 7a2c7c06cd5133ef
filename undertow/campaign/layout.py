"""Where trials stand in a store: along an axis for every key of `cross`, and one for the draws; a block is a task."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Int

from undertow.campaign.campaign_schema import Campaign

DRAWS = "draw"


class Layout(NamedTuple):
    """Axes of the store, cut into blocks.

    Attributes:
        crossed: number of values of every key of `cross`.
        draws: number of draws.
        chunk: size of a block along every axis, that of the draws last.
    """

    crossed: tuple[int, ...]
    draws: int
    chunk: tuple[int, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the whole."""
        return (*self.crossed, self.draws)

    @property
    def blocks(self) -> tuple[int, ...]:
        """How many there are along every axis."""
        return tuple(-(-size // step) for size, step in zip(self.shape, self.chunk, strict=True))

    @property
    def tasks(self) -> int:
        """How many blocks there are."""
        return math.prod(self.blocks)

    def block(self, task: int) -> tuple[int, ...]:
        """Where the block of a task is. All of the first draws come first: further draws are further tasks."""
        draw, *crossed = np.unravel_index(task, (self.blocks[-1], *self.blocks[:-1]))
        return (*map(int, crossed), int(draw))

    def region(self, task: int) -> tuple[slice, ...]:
        """What the block of a task covers."""
        covered = zip(self.block(task), self.chunk, self.shape, strict=True)
        return tuple(slice(i * step, min((i + 1) * step, size)) for i, step, size in covered)

    def count(self, task: int) -> int:
        """Trials of a task."""
        return math.prod(covered.stop - covered.start for covered in self.region(task))

    def trials(self, task: int) -> Int[np.ndarray, " trials"]:
        """Numbers of the trials of a task, in the order of its block."""
        *crossed, draws = self.region(task)
        combinations = np.arange(math.prod(self.crossed)).reshape(self.crossed)
        numbers = np.arange(draws.start, draws.stop) * combinations.size
        return (combinations[(*crossed, None)] + numbers).reshape(-1)

    def partial(self) -> range:
        """Tasks that would have more trials if there were more draws."""
        beside = math.prod(self.blocks[:-1])
        return range(self.draws // self.chunk[-1] * beside, self.tasks)


def layout(campaign: Campaign) -> Layout:
    """That of a new store: about as many trials in a task as are asked for, rather draws than combinations."""
    crossed = tuple(len(entries) for entries in campaign.axes.values())
    chunk = [min(campaign.chunk, max(campaign.trials, campaign.chunk // math.prod(crossed)))]
    for count in reversed(crossed):
        chunk.insert(0, min(count, campaign.chunk // math.prod(chunk)) or 1)
    return Layout(crossed, campaign.trials, tuple(chunk))
