"""What the quick tests cost: processor time in multiples of `import jax`, with empty caches and with full ones.

    python benchmarks/quick_tests.py [--cold] [arguments of pytest]

Processor time is user and system time of all processes. `import jax` is measured in the same minutes, three times
before and after each run; the least counts. With --cold only empty caches are measured. The exit code is that of the
tests, or 1 where a run took more than its budget.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
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


def import_of_jax() -> float:
    """Processor time of `import jax`, s."""
    return min(run("-c", "import jax").processor_s for _ in range(REPETITIONS))


def main() -> int:
    """Run the tests, once or twice, and print what they took."""
    chosen = ["empty caches"] if "--cold" in sys.argv else list(BUDGETS)
    arguments = [argument for argument in sys.argv[1:] if argument != "--cold"]
    lines, worst = [], 0
    with tempfile.TemporaryDirectory() as caches:
        for name in chosen:
            unit = import_of_jax()
            tests = run("-m", "pytest", *arguments, UNDERTOW_CACHE=caches, SIMDJIT_CACHE=f"{caches}/simdjit")
            unit = min(unit, import_of_jax())
            multiple = tests.processor_s / unit
            verdict = "within" if multiple <= BUDGETS[name] else "ABOVE"
            lines.append(
                f"quick tests, {name}: {tests.processor_s:.0f} s of processor time, {tests.wall_s:.0f} s; "
                f"{multiple:.0f} times `import jax` ({unit:.2f} s), {verdict} the budget of {BUDGETS[name]}"
            )
            worst = worst or tests.code or int(verdict == "ABOVE")
    print(*lines, sep="\n")
    return worst


if __name__ == "__main__":
    sys.exit(main())
