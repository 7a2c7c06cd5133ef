"""Executors of the tasks of a campaign: threads of this process unless a cluster is named, else its Dask workers.

A cluster `local` is processes on this machine; others are machines reached by SSH, or jobs of SLURM.
"""

import contextlib
import functools
import importlib.util
import itertools
import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any

import numpy as np

from undertow.core.errors import BadInput, nearest
from undertow.simulation import local_worker

Columns = dict[str, np.ndarray]
Work = tuple[Any, ...]  # arguments of the function
Executor = Callable[[Callable[..., Columns], Sequence[Work]], Iterator[tuple[int, Columns]]]

# Tasks per worker that run or wait: enough to keep it busy, few enough to fit in memory.
_AHEAD = 2

# Switch interval of threads, s; with Python's default of 5 ms, writing a task takes half a second, not a tenth.
_TURN = 2e-4


@contextlib.contextmanager
def make_executor(where: str | None, count: int) -> Iterator[Executor]:
    """The executor for a cluster (see `cluster`), or threads where none is named."""
    if where is None:
        yield functools.partial(in_threads, threads=count)
        return
    with cluster(where, count) as client:
        yield functools.partial(by_dask, client=client)


def in_threads(function: Callable[..., Columns], work: Sequence[Work], threads: int) -> Iterator[tuple[int, Columns]]:
    """Number and result of each piece of work as it is completed, by threads of this process."""
    with _taking_turns(), ThreadPoolExecutor(threads) as pool:
        waiting = enumerate(work)
        futures = {pool.submit(function, *arguments): i for i, arguments in itertools.islice(waiting, _AHEAD * threads)}
        try:
            while futures:
                done, _ = wait(futures, return_when=FIRST_COMPLETED)
                for future in done:
                    number = futures.pop(future)
                    for i, arguments in itertools.islice(waiting, 1):
                        futures[pool.submit(function, *arguments)] = i
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
    start = lambda arguments: client.submit(function, *arguments, pure=False, retries=3)
    numbers = {start(arguments): i for i, arguments in itertools.islice(waiting, ahead)}
    done = as_completed(list(numbers), raise_errors=False)
    try:
        for future in done:
            number, result = numbers.pop(future), future.result()
            future.release()
            for i, arguments in itertools.islice(waiting, 1):
                next_future = start(arguments)
                numbers[next_future] = i
                done.add(next_future)
            yield number, result
    except (FutureCancelledError, CommClosedError, TimeoutError) as error:
        raise OSError(f"the connection to the Dask cluster is lost ({error})") from error
    if numbers:
        raise OSError("the connection to the Dask cluster is lost")


CLUSTERS = ("local", "slurm", "ssh")
_NEEDED = {"slurm": ("dask_jobqueue",), "ssh": ("asyncssh",)}  # modules beside Dask

# Workers may die often. Dask's own monitoring at 50 Hz would take 3 % of a core in every process.
_DASK = {
    "distributed.scheduler.allowed-failures": 100,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "2s",
}

# Dask's dashboards have no authentication: those started here listen on this machine only.
_PAGE = "127.0.0.1:0"

_INSTALL = "In the folder of undertow, run: pip install -c constraints.txt '.[cluster]'"


def check_cluster(kind: str) -> None:
    """Check that the argument is a kind of cluster or an address, and that what it needs is there.

    Raises:
        BadInput: it is neither, or something is missing.
    """
    if "://" not in kind and kind not in CLUSTERS:
        must = f"be one of {', '.join(CLUSTERS)}, or an address such as tcp://10.0.0.1:8786"
        raise BadInput("--cluster", must, kind, hint=nearest(kind.lower(), CLUSTERS))
    for module in ("dask", "distributed", *_NEEDED.get(kind, ())):
        if importlib.util.find_spec(module) is None:
            raise BadInput("--cluster", f"have {module} installed", "not", hint=_INSTALL)
    if kind == "slurm":
        _check_slurm()
    elif kind == "ssh" and not _hosts():
        raise BadInput("UNDERTOW_HOSTS", "name the hosts, separated by commas", "not set")


@contextlib.contextmanager
def cluster(kind: str, workers: int) -> Iterator[Any]:
    """A client of a cluster started for this campaign, or of the scheduler at an address.

    Args:
        kind: local, slurm, ssh (hosts in the environment variable UNDERTOW_HOSTS, separated by commas), or an address
            such as tcp://10.0.0.1:8786.
        workers: number of workers to start; on each host, for ssh.

    Raises:
        BadInput: Dask is not installed, or no such cluster can be reached.
    """
    check_cluster(kind)
    from dask import config
    from distributed import Client

    with config.set(_DASK), contextlib.ExitStack() as stack:
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

        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            preload=[local_worker.__name__],
            host="127.0.0.1",
            dashboard_address=_PAGE,
            silence_logs=logging.CRITICAL,  # errors are raised here
        )
    if kind == "ssh":
        return _over_ssh(_hosts(), workers)
    return _in_slurm(workers)


def _hosts() -> list[str]:
    """Machines for a cluster by SSH."""
    return [name.strip() for name in os.environ.get("UNDERTOW_HOSTS", "").split(",") if name.strip()]


def _over_ssh(hosts: list[str], workers: int) -> Any:
    from asyncssh import Error
    from distributed import SSHCluster

    logging.getLogger("distributed.deploy").setLevel(logging.ERROR)  # an error is reported once, below
    try:
        return SSHCluster(
            [hosts[0], *hosts],
            scheduler_options={"dashboard_address": _PAGE},
            worker_options={"nthreads": 1, "n_workers": workers, "dashboard_address": _PAGE},
        )
    except (OSError, Error, RuntimeError) as error:
        reason = error.__cause__ or error
        hint = "`ssh HOST` must work without a prompt"
        raise BadInput(
            "UNDERTOW_HOSTS", "be hosts that accept the login", f"{','.join(hosts)}: {reason}", hint=hint
        ) from None


def _check_slurm() -> None:
    """Check that SLURM answers: otherwise Dask would submit jobs that cannot be queued again and again."""
    try:
        subprocess.run(["sinfo", "--noheader"], check=True, capture_output=True, text=True)
    except OSError as error:
        raise BadInput("--cluster", "find SLURM on this machine", str(error)) from None
    except subprocess.CalledProcessError as error:
        error_lines = error.stderr.strip().splitlines() or ["sinfo fails"]
        raise BadInput("--cluster", "find a SLURM that answers", error_lines[-1]) from None


def _in_slurm(workers: int) -> Any:
    from dask import config
    from dask_jobqueue.slurm import SLURMCluster

    setting = lambda key, usual: config.get(f"jobqueue.slurm.{key}", None) or usual
    cluster = SLURMCluster(
        cores=setting("cores", 1),
        memory=setting("memory", "2 GB"),
        scheduler_options={"dashboard_address": _PAGE, **(setting("scheduler-options", {}))},
        worker_extra_args=["--dashboard-address", _PAGE, *setting("worker-extra-args", [])],
    )
    cluster.scale(jobs=workers)
    return cluster
