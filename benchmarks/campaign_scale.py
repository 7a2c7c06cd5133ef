"""Cost of a campaign: python benchmarks/campaign_scale.py [memory|dask|pieces] [--trials N]

memory: 100 000 trials of workload W1, 1 s each, in this process: memory after a tenth of the tasks and at the end, its
peak, bytes of the store and time per trial; then seconds for summary and page, and the peak with them.
dask: 1 000 trials of W1, 20 s each, by one worker and by two of a local cluster: the ratio of the times once the
workers have compiled, the shortest of five each, and whether the stores are the same to the byte.
pieces: in one thread, milliseconds to build a trial among a thousand, with another start and gain or another mass of
the vehicle, and to build one alone; to write a task of 256 or 65 536 trials; and memory per trial while a task runs.

Prints JSON.
"""

import argparse
import contextlib
import json
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core import process_setup

process_setup.prepare()

from undertow.paper.setup import scenario
from undertow.report.campaign_page import write_campaign
from undertow.scenario.reading import dump
from undertow.simulation.executors import by_dask, cluster, in_threads
from undertow.studies.campaign import task
from undertow.studies.campaign.build_trials import build_trial, build_trials
from undertow.studies.campaign.campaign_summary import summary
from undertow.studies.campaign.columns import labels
from undertow.studies.campaign.fingerprint import Identity
from undertow.studies.campaign.prepare import prepare
from undertow.studies.campaign.run_campaign import STORE, run_campaign
from undertow.studies.campaign.store import Store
from undertow.studies.campaign.store_layout import StoreLayout
from undertow.studies.campaign.store_results import load

VARY = {"initial.position[0]": {"normal": [0.0, 0.1]}, "controller.composite": {"uniform": [10.0, 30.0]}}
HEAVIER = {"plant.vehicle.mass": {"normal": [125.0, 3.0]}}

_LARGE = 8192  # trials of the task whose memory is measured


def prepared(folder: Path, trials: int, duration: float, chunk: int | None = None, vary: dict | None = None):
    loop = {"kind": "sampled", "duration": duration}
    whole = scenario("W1", fidelity="electromechanical", composite=20.0, loop=loop) | {
        "initial": {"position": [0.0] * 6},
        "steady": {"start": duration / 2},
    }
    path = folder / "campaign.yaml"
    asked = {"scenario": whole, "trials": trials, "vary": VARY if vary is None else vary, "seed": 1}
    path.write_text(dump(asked | ({"chunk": chunk} if chunk else {})))
    return prepare(path)


def memory(trials: int) -> dict:
    """One process, all of its threads."""
    held, began = [], time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        campaign = prepared(Path(name), trials, 1.0)
        executor = lambda function, work: in_threads(function, work, 2)
        run_campaign(campaign, Path(name), executor, lambda tally: held.append((tally.done, _resident())))
        taken = time.perf_counter() - began
        peak, concluding = _peak(), time.perf_counter()
        size = sum(file.stat().st_size for file in (Path(name) / STORE).rglob("*") if file.is_file())
        results = load(Path(name))
        write_campaign("", results, summary(results, campaign.trials), Path(name))
        concluded = time.perf_counter() - concluding
    tenth = next(mebibytes for done, mebibytes in held if done >= trials / 10)
    return {
        "trials": trials,
        "after_first_tenth_MiB": tenth,
        "at_the_end_MiB": held[-1][1],
        "growth_percent": 100 * (max(mebibytes for done, mebibytes in held if done >= trials / 10) / tenth - 1),
        "peak_MiB": peak,
        "summary_and_page_s": concluded,
        "peak_with_them_MiB": _peak(),
        "store_bytes_per_trial": size / trials,
        "ms_per_trial": 1e3 * taken / trials,
    }


def pieces(trials: int) -> dict:
    """Building a trial, and writing a small or large task, in one thread; the shortest of three."""
    found = {}
    with tempfile.TemporaryDirectory() as name:
        for what, vary in (("build_start_and_gain_ms", VARY), ("build_mass_ms", HEAVIER)):
            campaign = prepared(Path(name), _LARGE, 1.0, 256, vary)
            here = task.task_context(campaign.text, str(campaign.folder))

            def build(i, here=here):
                rows = np.arange(i * trials, (i + 1) * trials)
                return list(build_trials(here.trials, here.part_cache, rows, here.trials.sampled(rows), here.traceable))

            found[what] = 1e3 * _shortest(build) / trials
            alone = lambda i, here=here: build_trial(here.trials, here.part_cache, i)
            found[what.replace("_ms", "_alone_ms")] = 1e3 * _shortest(alone)
        columns = task.run_trials(campaign.text, str(campaign.folder), range(256))
        before = _peak()
        task.run_trials(campaign.text, str(campaign.folder), range(_LARGE))
        found["task_KiB_per_trial"] = 1024 * (_peak() - before) / _LARGE
        for rows in (256, 65_536):
            named = labels(campaign.trials, campaign.first, here.metrics())
            where = Path(name) / f"{rows}.zarr"
            store = Store(where, StoreLayout((), 4 * rows, (rows,)), Identity("", {}), named, {}, {})
            chance = np.random.default_rng(0)  # random numbers cannot be compressed
            many = {key: chance.normal(size=rows).astype(values.dtype) for key, values in columns.items()}
            found[f"write_{rows}_ms"] = 1e3 * _shortest(lambda i, s=store, m=many: s.write(i, m))
            store.close()
    return found


def _shortest(work: Callable[[int], Any]) -> float:
    """Seconds of the shortest of three runs after a warm-up."""
    times = []
    for i in range(4):
        start = time.perf_counter()
        work(i)
        times.append(time.perf_counter() - start)
    return min(times[1:])


def _peak() -> float:
    """Peak memory, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _resident() -> float:
    """Resident memory, MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def dask(trials: int) -> dict:
    """One worker and two, in turn; the shortest of five times each.

    Every worker runs some trials first, so that compilation is not counted.
    """
    times: dict[int, list[float]] = {1: [], 2: []}
    stores = []
    with contextlib.ExitStack() as stack:
        name = stack.enter_context(tempfile.TemporaryDirectory())
        clients = {workers: stack.enter_context(cluster("local", workers)) for workers in times}
        for workers, client in clients.items():
            client.wait_for_workers(workers)
        for number in range(5):
            for workers, client in clients.items():
                folder = Path(name) / f"{workers}-{number}"
                folder.mkdir()
                campaign = prepared(folder, trials, 20.0, 256)
                client.run(task.run_trials, campaign.text, str(campaign.folder), range(8))
                start = time.perf_counter()
                run_campaign(campaign, folder, lambda f, work, c=client: by_dask(f, work, c), lambda *_: None)
                times[workers].append(time.perf_counter() - start)
                files = sorted(file for file in (folder / STORE).rglob("*") if file.is_file())
                stores.append({str(file.relative_to(folder)): file.read_bytes() for file in files})
    one, two = map(min, times.values())
    return {
        "trials": trials,
        "one_worker_s": one,
        "two_workers_s": two,
        "times_faster": one / two,
        "same_bytes": all(store == stores[0] for store in stores),
    }


MEASURED = {"memory": (memory, 100_000), "dask": (dask, 1_000), "pieces": (pieces, 1000)}  # and trials unless given

if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=list(MEASURED))
    parser.add_argument("--trials", type=int)
    asked = parser.parse_args()
    measure, usual = MEASURED[asked.what]
    measured = measure(asked.trials or usual)
    print(json.dumps({key: round(value, 3) if isinstance(value, float) else value for key, value in measured.items()}))
