"""Who flies the tasks of a campaign: the threads of this process, or the workers of a Dask cluster."""

import contextlib
import itertools
import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any

import numpy as np

from undertow.core.errors import BadInput

Columns = dict[str, np.ndarray]
Work = tuple[Any, ...]  # arguments of the function

# Tasks per worker that are under way or waiting: enough to keep it busy, few enough to stay in memory.
_AHEAD = 2

# Before another thread gets its turn, s; Python's own 5 ms are a tenth of a second for every column that is written.
_TURN = 2e-4

CLUSTERS = ("local", "slurm", "ssh")


def in_threads(function: Callable[..., Columns], work: Sequence[Work], threads: int) -> Iterator[tuple[int, Columns]]:
    """Number and result of each piece of work as it is done, by threads of this process."""
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
    """Let Python change between threads often: one that writes needs hundreds of short turns for every task."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(_TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(usual)


def by_dask(function: Callable[..., Columns], work: Sequence[Work], client: Any) -> Iterator[tuple[int, Columns]]:
    """Number and result of each piece of work as it is done, by the workers of a `dask.distributed` client.

    A worker that is killed loses nothing: its work is given to another one.

    Raises:
        OSError: the cluster is gone.
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
        raise OSError(f"the Dask cluster is gone ({error})") from error
    if numbers:
        raise OSError("the Dask cluster is gone")


@contextlib.contextmanager
def cluster(kind: str, workers: int) -> Iterator[Any]:
    """A client of a cluster that is started for this campaign, or of the scheduler at an address.

    Args:
        kind: local, slurm, ssh (hosts in the environment variable UNDERTOW_HOSTS, separated by commas), or an address
            such as tcp://10.0.0.1:8786.
        workers: how many are started; on each host where they are several.

    Raises:
        BadInput: Dask is not installed, or no such cluster can be reached.
    """
    try:
        from dask import config
        from distributed import Client
    except ImportError:
        hint = "pip install 'undertow[campaign]'"
        raise BadInput("--cluster", "have Dask installed", "not", hint=hint) from None
    with config.set({"distributed.scheduler.allowed-failures": 100}), contextlib.ExitStack() as stack:
        where = kind if "://" in kind else stack.enter_context(_started(kind, workers))
        try:
            client = stack.enter_context(Client(where, timeout=10))
        except OSError as error:
            raise BadInput("--cluster", "be a scheduler that answers", f"{kind}: {error}") from None
        client.wait_for_workers(1)
        yield client


def _started(kind: str, workers: int) -> Any:
    if kind == "local":
        from distributed import LocalCluster

        from undertow.studies.campaign import local_worker

        quiet = {"dashboard_address": ":0", "silence_logs": logging.ERROR}
        return LocalCluster(n_workers=workers, threads_per_worker=1, preload=[local_worker.__name__], **quiet)
    if kind == "ssh":
        return _over_ssh(os.environ.get("UNDERTOW_HOSTS", ""), workers)
    if kind == "slurm":
        return _in_slurm(workers)
    raise BadInput("--cluster", f"be one of {', '.join(CLUSTERS)}, or an address", kind)


def _over_ssh(names: str, workers: int) -> Any:
    from asyncssh import Error
    from distributed import SSHCluster

    hosts = [name.strip() for name in names.split(",") if name.strip()]
    if not hosts:
        raise BadInput("UNDERTOW_HOSTS", "name the hosts, separated by commas", "not set")
    logging.getLogger("distributed.deploy").setLevel(logging.ERROR)  # what goes wrong is said once, below
    try:
        return SSHCluster([hosts[0], *hosts], worker_options={"nthreads": 1, "n_workers": workers})
    except (OSError, Error, RuntimeError) as error:
        reason = error.__cause__ or error
        hint = "`ssh HOST` must work without a question"
        raise BadInput("UNDERTOW_HOSTS", "be hosts that let us in", f"{names}: {reason}", hint=hint) from None


def _in_slurm(workers: int) -> Any:
    from dask import config
    from dask_jobqueue.slurm import SLURMCluster

    try:  # jobs that cannot be queued would be asked for again and again
        subprocess.run(["sinfo", "--noheader"], check=True, capture_output=True, text=True)
    except OSError as error:
        raise BadInput("--cluster", "find a SLURM here", str(error)) from None
    except subprocess.CalledProcessError as error:
        said = error.stderr.strip().splitlines() or ["sinfo fails"]
        raise BadInput("--cluster", "find a SLURM that answers", said[-1]) from None
    told = lambda key, usual: config.get(f"jobqueue.slurm.{key}", None) or usual
    found = SLURMCluster(cores=told("cores", 1), memory=told("memory", "2 GB"))
    found.scale(jobs=workers)
    return found
