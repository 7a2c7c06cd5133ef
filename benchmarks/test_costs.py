"""Where the time of the tests goes: a plugin of pytest that prints processor time by folder and by kind of work.

    PYTHONPATH=benchmarks python -m pytest -p test_costs                     # the quick set
    PYTHONPATH=benchmarks python -m pytest -p test_costs -m full -n auto     # the full set
    PYTHONPATH=benchmarks python -m pytest -p test_costs --cost-of test      # by test; also `file`

With UNDERTOW_CACHE=$(mktemp -d) caches are empty. A line has the processor time of a folder's tests, with their
fixtures and child processes, and of it what JAX traced and lowered, XLA compiled, LLVM compiled for the batch compiler,
and child processes took. The rest is Python and arithmetic. "collection" is imports, once per worker.
"""

import collections
import itertools
import os
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

# Event of JAX -> kind of work.
EVENTS = {"jaxpr_trace": "tracing", "jaxpr_to_mlir_module": "lowering", "backend_compile": "XLA"}
COLUMNS = ("total", "tracing", "lowering", "XLA", "LLVM", "processes", "rest")
LABELS: dict[str, Callable[[str], str]] = {
    "folder": lambda test: test.removeprefix("tests/").split("/")[0],
    "file": lambda test: test.split("::")[0],
    "test": str,
}
LONGEST = 40
BEGAN = pytest.StashKey[tuple[float, float, float]]()

# Of the test that runs, by kind; and what the collection took, by worker.
spent: collections.Counter[str] = collections.Counter()
collection: dict[str, float] = {}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--cost-of", choices=("folder", "file", "test"), default="folder", help="what a line is about")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        return  # the controller of workers runs no test
    import jax

    from simdjit import cpu

    jax.monitoring.register_event_duration_secs_listener(_count_event)
    cpu._compiled = _timed(cpu._compiled)


def _count_event(event: str, seconds: float, **_: Any) -> None:
    kind = EVENTS.get(event.rsplit("/", 1)[-1].removesuffix("_duration"))
    if kind:
        spent[kind] += seconds


def _timed(function: Callable[..., bytes]) -> Callable[..., bytes]:
    def timed(*arguments: Any) -> bytes:
        began = time.perf_counter()
        result = function(*arguments)
        spent["LLVM"] += time.perf_counter() - began
        return result

    return timed


def _children() -> float:
    times = os.times()
    return times.children_user + times.children_system


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    spent.clear()
    item.stash[BEGAN] = time.perf_counter(), time.process_time(), _children()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """The report of a test's end carries its costs, from a worker as well."""
    report = yield
    if call.when == "teardown":
        ends = time.perf_counter(), time.process_time(), _children()
        wall, own, children = (end - begin for end, begin in zip(ends, item.stash[BEGAN], strict=True))
        # Events have times by the clock on the wall; a busy machine stretches all of them alike.
        costs = {kind: seconds * min(1.0, own / wall) for kind, seconds in spent.items()}
        report.user_properties.append(("cost", costs | {"total": own + children, "processes": children}))
    return report


def pytest_collection_finish(session: pytest.Session) -> None:
    collection["here"] = time.process_time()
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["collection"] = time.process_time()


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    collection[node.gateway.id] = getattr(node, "workeroutput", {}).get("collection", 0.0)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    label = LABELS[config.getoption("--cost-of")]
    table: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for report in itertools.chain.from_iterable(terminalreporter.stats.values()):
        costs = dict(getattr(report, "user_properties", ())).get("cost")
        if costs and report.when == "teardown":
            table[label(report.nodeid)].update(costs)
    table["collection"]["total"] = sum(collection.values())
    rows = sorted(table.items(), key=lambda row: -row[1]["total"])
    rows = [*rows[:LONGEST], ("all", sum(table.values(), collections.Counter()))]
    write = terminalreporter.write_line
    write(f"{'processor time, s':60}" + "".join(f"{column:>10}" for column in COLUMNS))
    for name, costs in rows:
        costs["rest"] = costs["total"] - sum(costs[kind] for kind in COLUMNS[1:-1])
        write(f"{name[-60:]:60}" + "".join(f"{costs[column]:10.1f}" for column in COLUMNS))
