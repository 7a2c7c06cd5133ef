"""What the quick tests cost: processor time in multiples of `import jax`, with empty caches and with full ones.

    python benchmarks/quick_tests.py [--cold] [--caches DIR]

Processor time is user and system time of all processes. `import jax` is measured in the same minutes, three times
before and after each run; the median counts. With --cold only empty caches are measured; --caches names the folder, and
keeps it. The exit code is that of the tests, or 1 where a run took more than its budget.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

# In multiples of `import jax`.
BUDGETS = {"empty caches": 200, "full caches": 80}
REPETITIONS = 3


class Run(NamedTuple):
    """An ended process."""

    code: int
    processor_s: float
    wall_s: float


def run(*arguments: str, **environment: str) -> Run:
    """Python with these arguments, until it ends."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    code = subprocess.run([sys.executable, *arguments], env=os.environ | environment).returncode
    after, ended = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Run(code, processor, ended - began)


def imports_of_jax() -> list[float]:
    """Processor times of `import jax`, s."""
    return [run("-c", "import jax").processor_s for _ in range(REPETITIONS)]


def measured(name: str, caches: str) -> tuple[int, str]:
    """Run the tests: exit code, and a sentence on what they took."""
    before = imports_of_jax()
    tests = run("-m", "pytest", UNDERTOW_CACHE=caches, SIMDJIT_CACHE=f"{caches}/simdjit")
    unit = statistics.median(before + imports_of_jax())
    multiple = tests.processor_s / unit
    within = multiple <= BUDGETS[name]
    sentence = (
        f"quick tests, {name}: {tests.processor_s:.0f} s of processor time, {tests.wall_s:.0f} s; {multiple:.0f} times "
        f"`import jax` ({unit:.2f} s), {'within' if within else 'ABOVE'} the budget of {BUDGETS[name]}"
    )
    return tests.code or int(not within), sentence


def main() -> int:
    """Run the tests, once or twice, and print what they took."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cold", action="store_true", help="empty caches only")
    parser.add_argument("--caches", type=Path, help="an empty folder for the caches, which is kept")
    options = parser.parse_args()
    if options.caches and options.caches.is_dir() and any(options.caches.iterdir()):
        parser.error(f"--caches must be an empty folder, and {options.caches} is not")
    with tempfile.TemporaryDirectory() as folder:
        caches = str(options.caches.resolve()) if options.caches else folder
        runs = [measured(name, caches) for name in list(BUDGETS)[: 1 if options.cold else None]]
    print(*[sentence for _, sentence in runs], sep="\n")
    return max(code for code, _ in runs)


if __name__ == "__main__":
    sys.exit(main())
