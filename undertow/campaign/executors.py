"""Executors of the tasks of a campaign: threads of this process, or the workers of a Dask cluster."""

import contextlib
import itertools
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any

import numpy as np

Columns = dict[str, np.ndarray]
Work = tuple[Any, ...]  # arguments of the function

# Tasks per worker that run or wait: enough to keep it busy, few enough to fit in memory.
_AHEAD = 2

# Switch interval of threads, s; with Python's default of 5 ms, writing a task takes half a second, not a tenth.
_TURN = 2e-4


def in_threads(function: Callable[..., Columns], work: Sequence[Work], threads: int) -> Iterator[tuple[int, Columns]]:
    """Number and result of each piece of work as it is completed, by threads of this process."""
    with _taking_turns(), ThreadPoolExecutor(threads) as pool:
        waiting = enumerate(work)
        going = {pool.submit(function, *one): i for i, one in itertools.islice(waiting, _AHEAD * threads)}
        try:
            while going:
                done, _ = wait(going, return_when=FIRST_COMPLETED)
                for future in done:
                    number = going.pop(future)
                    for i, one in itertools.islice(waiting, 1):
                        going[pool.submit(function, *one)] = i
                    yield number, future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextlib.contextmanager
def _taking_turns() -> Iterator[None]:
    """Switch between threads often: writing a task needs hundreds of short turns."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(_TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(usual)


def by_dask(function: Callable[..., Columns], work: Sequence[Work], client: Any) -> Iterator[tuple[int, Columns]]:
    """Number and result of each piece of work as it is completed, by the workers of a `dask.distributed` client.

    The work of a killed worker is given to another one.

    Raises:
        OSError: the connection to the cluster is lost.
    """
    from distributed import as_completed
    from distributed.client import FutureCancelledError
    from distributed.comm.core import CommClosedError

    waiting = enumerate(work)
    ahead = _AHEAD * max(1, sum(client.nthreads().values()))
    start = lambda one: client.submit(function, *one, pure=False, retries=3)
    numbers = {start(one): i for i, one in itertools.islice(waiting, ahead)}
    done = as_completed(list(numbers), raise_errors=False)
    try:
        for future in done:
            number, result = numbers.pop(future), future.result()
            future.release()
            for i, one in itertools.islice(waiting, 1):
                further = start(one)
                numbers[further] = i
                done.add(further)
            yield number, result
    except (FutureCancelledError, CommClosedError, TimeoutError) as error:
        raise OSError(f"the connection to the Dask cluster is lost ({error})") from error
    if numbers:
        raise OSError("the connection to the Dask cluster is lost")
