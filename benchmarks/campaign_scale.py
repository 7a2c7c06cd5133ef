"""What a campaign costs: python benchmarks/campaign_scale.py [memory|dask] [--trials N]

memory: 100 000 trials of workload W1, 1 s each, in this process. Memory after the first tenth of the tasks and at the
end, its peak, bytes of the store and time per trial.
dask: 1 000 trials of W1, 20 s each, by one worker and by two of a local cluster: the ratio of the times once the
workers have compiled, and whether the stores are the same to the byte.

Prints JSON.
"""

import argparse
import json
import resource
import tempfile
import time
from pathlib import Path

from undertow import process

process.prepare()

from undertow.scenario.reading import dump
from undertow.studies.campaign import task
from undertow.studies.campaign.conduct import STORE, conduct, prepare
from undertow.studies.campaign.engines import by_dask, cluster, in_threads
from undertow.studies.paper.setup import scenario

VARY = {
    "initial.position[0]": {"normal": [0.0, 0.1]},
    "controller.composite": {"uniform": [10.0, 30.0]},
}


def prepared(folder: Path, trials: int, duration: float, chunk: int):
    loop = {"kind": "sampled", "duration": duration}
    whole = scenario("W1", rung="electromechanical", composite=20.0, loop=loop) | {
        "initial": {"position": [0.0] * 6},
        "steady": {"start": duration / 2},
    }
    path = folder / "campaign.yaml"
    path.write_text(dump({"scenario": whole, "trials": trials, "chunk": chunk, "vary": VARY, "seed": 1}))
    return prepare(path)


def memory(trials: int) -> dict:
    """One process, all of its threads."""
    held, began = [], time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        campaign = prepared(Path(name), trials, 1.0, 256)
        engine = lambda function, work: in_threads(function, work, 2)
        conduct(campaign, Path(name), engine, lambda done, total, failed: held.append((done, _resident())))
        taken = time.perf_counter() - began
        size = sum(file.stat().st_size for file in (Path(name) / STORE).rglob("*") if file.is_file())
    tenth = next(mebibytes for done, mebibytes in held if done >= trials / 10)
    return {
        "trials": trials,
        "after_first_tenth_MiB": tenth,
        "at_the_end_MiB": held[-1][1],
        "growth_percent": 100 * (max(mebibytes for done, mebibytes in held if done >= trials / 10) / tenth - 1),
        "peak_MiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "store_bytes_per_trial": size / trials,
        "ms_per_trial": 1e3 * taken / trials,
    }


def _resident() -> float:
    """MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def dask(trials: int) -> dict:
    """One worker and two; each flies a task first, so that compiling is not counted."""
    times, stores = [], []
    with tempfile.TemporaryDirectory() as name:
        for workers in (1, 2):
            folder = Path(name) / str(workers)
            folder.mkdir()
            campaign = prepared(folder, trials, 20.0, 25)
            with cluster("local", workers) as client:
                client.wait_for_workers(workers)
                client.run(task.fly, campaign.text, str(campaign.folder), range(8))
                start = time.perf_counter()
                conduct(campaign, folder, lambda f, work, c=client: by_dask(f, work, c), lambda *_: None)
                times.append(time.perf_counter() - start)
            files = sorted(file for file in (folder / STORE).rglob("*") if file.is_file())
            stores.append({str(file.relative_to(folder)): file.read_bytes() for file in files})
    return {
        "trials": trials,
        "one_worker_s": times[0],
        "two_workers_s": times[1],
        "times_faster": times[0] / times[1],
        "same_bytes": stores[0] == stores[1],
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["memory", "dask"])
    parser.add_argument("--trials", type=int)
    asked = parser.parse_args()
    measured = memory(asked.trials or 100_000) if asked.what == "memory" else dask(asked.trials or 1_000)
    print(json.dumps({key: round(value, 3) if isinstance(value, float) else value for key, value in measured.items()}))
