"""The tables of docs/explanation/scale.md, simd.md and speed.md.

    python benchmarks/tables.py scale|batch|rivals [--write]

Every figure is measured anew, in processes of its own, which takes ten minutes for `scale`, five for `batch` and twenty
for `rivals`, whose tools simdjit/benchmarks/rivals names. The table names the machine, the date and the commit. With
--write it replaces the one between the marks of its page.
"""

import argparse
import datetime
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "simdjit/benchmarks/rivals"))

from ranking import table

EXPLANATION = HERE.parent / "docs/explanation"
PAGES = {"scale": EXPLANATION / "scale.md", "batch": EXPLANATION / "simd.md", "rivals": EXPLANATION / "speed.md"}
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"

# Rounded prices of 2026, $ per hour, and the power of a laptop, W.
CORE_HOUR, GPU_HOUR, LAPTOP = 0.04, 2.50, 50
# Bound of an H100 in single precision: 132 units of 128 numbers at 1.7 GHz, and 10 000 machine instructions per step
# of W1 (NVIDIA's assembler).
GPU_STEPS = 132 * 128 * 1.7e9 / 10_000


def result(*command: str) -> Any:
    """What a command prints as JSON."""
    print(" ".join(command), file=sys.stderr)
    run = subprocess.run([sys.executable, *command], check=True, capture_output=True, text=True)
    return json.loads(run.stdout[run.stdout.index("{") :])


def benchmark(name: str, *arguments: str) -> Any:
    return result(str(HERE / name), *arguments)


def scale() -> list[tuple[str, ...]]:
    """Cost of campaigns; the last rows are computed from the others."""
    speed = result("-m", "undertow", "bench", "--json")
    pieces = benchmark("campaign_scale.py", "pieces")
    short = benchmark("campaign_scale.py", "memory")
    million = benchmark("campaign_scale.py", "memory", "--trials", "1000000")
    dask = benchmark("campaign_scale.py", "dask")
    trial = 1e3 * dask["one_worker_s"] / dask["trials"]  # ms of one core, 20 s simulated
    cores = speed["threads"]
    per_short = cores * million["ms_per_trial"]  # ms of one core, 1 s simulated
    nodes = 100 * 64
    return [
        ("quantity", "measured", "by"),
        ("one step of W1, one thread", f"{speed['batch_float64_one_thread_ns']:.0f} ns", "`undertow bench --json`"),
        ("the same in single precision", f"{speed['batch_float32_one_thread_ns']:.0f} ns", ""),
        ("building a trial among others: start and gain differ", us(pieces["build_start_and_gain_ms"]), "`pieces`"),
        ("the same, mass of the vehicle differs", us(pieces["build_mass_ms"]), ""),
        ("building a trial alone", f"{pieces['build_mass_alone_ms']:.1f} ms", ""),
        ("memory of a trial while its task runs", f"{pieces['task_KiB_per_trial']:.0f} KiB", ""),
        ("writing a task of 256 trials", f"{pieces['write_256_ms']:.0f} ms", ""),
        ("writing a task of 65 536 trials", f"{pieces['write_65536_ms']:.0f} ms", ""),
        ("100 000 trials of one second", f"{short['ms_per_trial']:.2f} ms per trial", "`memory`"),
        ("1 000 000 trials of one second", f"{million['ms_per_trial']:.2f} ms per trial", "`memory --trials 1000000`"),
        ("memory while they run, after a tenth and at most", both(million), ""),
        ("summary and page of them", f"{million['summary_and_page_s']:.0f} s", ""),
        ("memory with summary and page", f"{million['peak_with_them_MiB']:.0f} MiB", ""),
        ("store", f"{million['store_bytes_per_trial']:.0f} bytes per trial", ""),
        ("a trial of 20 s, one Dask worker", f"{trial:.1f} ms", "`dask`"),
        ("two Dask workers", f"{dask['times_faster']:.2f} times as fast, {same(dask)}", ""),
        ("*computed:* 1e6 trials of 20 s on a laptop, 8 cores", laptop(1e6 * trial), ""),
        ("1e6 trials of 20 s on 100 nodes of 64 cores", cluster(1e6 * trial, nodes), ""),
        ("1e9 trials of 20 s on 100 nodes of 64 cores", cluster(1e9 * trial, nodes), ""),
        ("1e9 trials of 1 s on 100 nodes of 64 cores", cluster(1e9 * per_short, nodes), ""),
        ("1e6 trials of 20 s on one H100, bound of its arithmetic", gpu(1e6 * 20_000), ""),
        ("1e9 trials of 20 s on one H100, bound of its arithmetic", gpu(1e9 * 20_000), ""),
    ]


def batch() -> list[tuple[str, ...]]:
    """Speed of the batch compiler, and how it scales."""
    speed = result("-m", "undertow", "bench", "--json")
    scaling = benchmark("compiler_scale.py") | benchmark("../simdjit/benchmarks/against_xla.py")
    numpy = speed["numpy_ns"]
    by_hand = benchmark("yardstick.py", "--json")
    rows: list[tuple[str, ...]] = [("W1, plain NumPy", "", "", f"{thousands(numpy)} ns", "1")]
    ns = by_hand["yardstick_ns"]
    rows.append(("W1, one run, hand-written C++", "", "", f"{thousands(ns)} ns", thousands(numpy / ns)))
    named = {
        "W1, one run, by XLA": ("single_xla_ns", "single_xla_compile_s", ""),
        "W1, one run": ("single_ns", "single_compile_s", ""),
        "W1, many runs, one thread": (
            "batch_float64_one_thread_ns",
            "batch_float64_compile_s",
            "batch_float64_operations",
        ),
        "W1, many runs, all threads": ("batch_float64_ns", "", ""),
        "W1, many runs, all threads, single precision": ("batch_float32_ns", "batch_float32_compile_s", ""),
        "W2, one run": ("w2_single_ns", "w2_single_compile_s", ""),
        "W2, many runs, all threads": (
            "w2_batch_float64_ns",
            "w2_batch_float64_compile_s",
            "w2_batch_float64_operations",
        ),
    }
    for what, (ns, compiling, operations) in named.items():
        times = thousands(numpy / speed[ns]) if what.startswith("W1") else ""
        seconds = f"{speed[compiling]:.1f} s" if compiling else ""
        count = thousands(speed[operations]) if operations else ""
        rows.append((what, count, seconds, f"{thousands(speed[ns])} ns", times))
    words = {
        "thrusters": "{} thrusters, preset `robust`",
        "sets": "W1 with {} sets",
        "products": "product of matrices, {} rows",
    }
    for kind, sizes in scaling.items():
        for size, one in sizes.items():
            rows.append((words[kind].format(size), *compiled(one)))
    return [("step", "operations", "compiling", "time per step and run", "times NumPy, or XLA's time"), *rows]


def rivals() -> list[tuple[str, ...]]:
    """simdjit beside other tools, on plants that they can state, and W1 beside XLA and C++."""
    rows = benchmark("../simdjit/benchmarks/rivals", "--json")["rows"]
    by_hand = benchmark("yardstick.py", "--json")
    by_xla = benchmark("compiler_scale.py", "sets")["sets"]["5"]  # W1 has five
    a_second = 1000  # steps of W1
    for tool, setting, ns in (
        ("simdjit", "64 runs at once", by_hand["batch_one_thread_ns"]),
        ("simdjit", "one run", by_hand["single_ns"]),
        ("XLA, vmap", "64 runs at once", by_xla["xla_ns"]),
        ("C++ by hand", "one run", by_hand["yardstick_ns"]),
    ):
        rows.append({"problem": "W1, vehicle and law at 1 kHz", "tool": tool, "setting": setting, "ns": ns * a_second})
    return table(rows)


def compiled(one: dict[str, Any]) -> tuple[str, ...]:
    """Operations, seconds to compile, time of a step, and that by XLA; or why the compiler leaves it to XLA."""
    if "left_to_xla" in one:
        return "", "", f"left to XLA: {one['left_to_xla']}", ""
    ns, by_xla = thousands(one["simdjit_ns"]), thousands(one["xla_ns"])
    return thousands(one["operations"]), f"{one['simdjit_compile_s']:.1f} s", f"{ns} ns", f"XLA {by_xla} ns"


def thousands(value: float) -> str:
    """Three digits, with spaces between groups of thousands; counts below a million as they are."""
    rounded = value if float(value).is_integer() and value < 1e6 else float(f"{value:.3g}")
    return f"{rounded:,.0f}".replace(",", " ") if abs(rounded) >= 100 else f"{rounded:g}"


def us(milliseconds: float) -> str:
    return f"{1e3 * milliseconds:.0f} us"


def both(memory: dict[str, float]) -> str:
    return f"{memory['after_first_tenth_MiB']:.0f} and {memory['peak_MiB']:.0f} MiB"


def same(dask: dict[str, Any]) -> str:
    return "same bytes" if dask["same_bytes"] else "OTHER BYTES"


def laptop(milliseconds: float) -> str:
    hours = milliseconds / 3.6e6 / 8
    return f"{duration(3600 * hours)}, {LAPTOP * hours:.0f} Wh"


def cluster(milliseconds: float, cores: int) -> str:
    hours = milliseconds / 3.6e6
    return f"{duration(3600 * hours / cores)}, {CORE_HOUR * hours:.2g} $"


def gpu(steps: float) -> str:
    seconds = steps / GPU_STEPS
    return f"{duration(seconds)}, {GPU_HOUR * seconds / 3600:.2g} $"


def duration(seconds: float) -> str:
    for size, unit in ((3600, "h"), (60, "min")):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.2g} s"


def machine() -> str:
    """Model of the processor and number of its cores that may be used."""
    model = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    named = model[1] if model else "a processor of unknown model"
    return f"{len(os.sched_getaffinity(0))} cores of {named}"


def page(rows: list[tuple[str, ...]], what: str) -> str:
    """The table in Markdown, under a line with machine, date and commit."""
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, cwd=HERE)
    head, *others = rows
    line = lambda cells: "| " + " | ".join(cells) + " |"
    today = datetime.date.today().isoformat()
    measured = (
        f"Measured by `python benchmarks/tables.py {what}` on {machine()}, {today}, commit {commit.stdout.strip()}:"
    )
    return "\n".join([measured, "", line(head), "|" + "---|" * len(head), *map(line, others)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=list(PAGES))
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    text = page({"scale": scale, "batch": batch, "rivals": rivals}[asked.what](), asked.what)
    print(text)
    if asked.write:
        path = PAGES[asked.what]
        before, rest = path.read_text("utf-8").split(BEGIN)
        path.write_text(f"{before}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
