"""Clusters of Dask for a campaign: started on this machine, by SLURM, over SSH, or running somewhere already."""

import contextlib
import logging
import os
import subprocess
from collections.abc import Iterator
from typing import Any

from undertow.core.errors import BadInput, nearest

CLUSTERS = ("local", "slurm", "ssh")

# A worker may die often; and what Dask notes of itself fifty times a second takes 3 % of a core in every process.
_DASK = {
    "distributed.scheduler.allowed-failures": 100,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "2s",
}

# Dask's status pages ask nobody who they are: this machine alone may look at those that are started here.
_PAGE = "127.0.0.1:0"

_INSTALL = "pip install 'undertow[campaign]'"


def check_cluster(kind: str) -> None:
    """That there is such a kind of cluster, or that it is an address.

    Raises:
        BadInput: neither.
    """
    if "://" not in kind and kind not in CLUSTERS:
        must = f"be one of {', '.join(CLUSTERS)}, or an address such as tcp://10.0.0.1:8786"
        raise BadInput("--cluster", must, kind, hint=nearest(kind.lower(), CLUSTERS))


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
    check_cluster(kind)
    try:
        from dask import config
        from distributed import Client
    except ImportError:
        raise BadInput("--cluster", "have Dask installed", "not", hint=_INSTALL) from None
    with config.set(_DASK), contextlib.ExitStack() as stack:
        try:
            where = kind if "://" in kind else stack.enter_context(_started(kind, workers))
        except ModuleNotFoundError as error:
            raise BadInput("--cluster", f"have {error.name} installed", "not", hint=_INSTALL) from None
        try:
            client = stack.enter_context(Client(where, timeout=10))
        except OSError as error:
            raise BadInput("--cluster", "be a scheduler that answers", f"{kind}: {error}") from None
        client.wait_for_workers(1)
        yield client


def _started(kind: str, workers: int) -> Any:
    if kind == "local":
        from distributed import LocalCluster

        from undertow.campaign import local_worker

        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            preload=[local_worker.__name__],
            host="127.0.0.1",
            dashboard_address=_PAGE,
            silence_logs=logging.CRITICAL,  # what matters is raised here
        )
    if kind == "ssh":
        return _over_ssh(os.environ.get("UNDERTOW_HOSTS", ""), workers)
    return _in_slurm(workers)


def _over_ssh(names: str, workers: int) -> Any:
    from asyncssh import Error
    from distributed import SSHCluster

    hosts = [name.strip() for name in names.split(",") if name.strip()]
    if not hosts:
        raise BadInput("UNDERTOW_HOSTS", "name the hosts, separated by commas", "not set")
    logging.getLogger("distributed.deploy").setLevel(logging.ERROR)  # what goes wrong is said once, below
    try:
        return SSHCluster(
            [hosts[0], *hosts],
            scheduler_options={"dashboard_address": _PAGE},
            worker_options={"nthreads": 1, "n_workers": workers, "dashboard_address": _PAGE},
        )
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
    found = SLURMCluster(
        cores=told("cores", 1),
        memory=told("memory", "2 GB"),
        scheduler_options={"dashboard_address": _PAGE, **(told("scheduler-options", {}))},
        worker_extra_args=["--dashboard-address", _PAGE, *told("worker-extra-args", [])],
    )
    found.scale(jobs=workers)
    return found
