"""Blocks of a store: every trial in one task, and further samples in further tasks."""

import numpy as np
import pytest

from undertow.scenario.reading import from_data
from undertow.studies.campaign.campaign_schema import validate
from undertow.studies.campaign.store_layout import layout

SIZES = [((), 40, 16), ((2,), 40, 16), ((2, 3), 5, 16), ((7, 3), 1, 10), ((3, 1, 4), 9, 4), ((2,), 3, 256)]


def made(campaign, swept, samples, chunk):
    cross = {f"controller.k{i}": list(range(count)) for i, count in enumerate(swept)}
    return layout(validate(from_data(campaign(trials=samples, chunk=chunk, cross=cross))))


@pytest.mark.parametrize("swept, samples, chunk", SIZES)
def test_a_task_is_a_block_of_the_numbers_of_all_trials(campaign, swept, samples, chunk):
    """Numbers: all combinations with the first sample, then with the next one."""
    found = made(campaign, swept, samples, chunk)
    numbers = np.moveaxis(np.arange(found.samples * max(1, np.prod(swept, dtype=int))).reshape(samples, *swept), 0, -1)
    assert found.shape == numbers.shape
    for task in range(found.tasks):
        np.testing.assert_array_equal(found.trials(task), numbers[found.region(task)].ravel())
        assert 0 < found.count(task) == len(found.trials(task)) <= chunk
        assert [one.start // step for one, step in zip(found.region(task), found.chunk, strict=True)] == [
            *found.block(task)
        ]
    every = np.concatenate([found.trials(task) for task in range(found.tasks)])
    np.testing.assert_array_equal(np.sort(every), np.arange(numbers.size))


@pytest.mark.parametrize("swept, samples, chunk", SIZES)
def test_further_draws_are_further_tasks(campaign, swept, samples, chunk):
    before = made(campaign, swept, samples, chunk)
    after = before._replace(samples=3 * samples + 7)
    changed = [task for task in range(before.tasks) if before.trials(task).tolist() != after.trials(task).tolist()]
    assert changed == list(before.partial())


@pytest.mark.parametrize(
    "swept, samples, chunk, block",
    [
        ((), 40, 256, (256,)),
        ((2,), 1000, 256, (1, 256)),
        ((30,), 64, 256, (4, 64)),
        pytest.param((6000,), 1, 256, (256, 1), marks=pytest.mark.full),
        ((5, 20), 2, 256, (5, 20, 2)),
        ((50, 20), 2, 256, (6, 20, 2)),
        ((2,), 20, 256, (2, 128)),
    ],
)
def test_a_task_has_many_draws_of_few_combinations(campaign, swept, samples, chunk, block):
    """As laws and vehicles are programs of their own, and what differs by numbers only shares one."""
    assert made(campaign, swept, samples, chunk).chunk == block
