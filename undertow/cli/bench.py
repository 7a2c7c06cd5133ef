"""`undertow bench`: how fast it is here."""

import json

import typer
from rich.table import Table

from undertow.cli.exit_codes import DONE
from undertow.cli.interruptible import interruptible
from undertow.cli.stages import shares
from undertow.cli.tables import wide_console
from undertow.studies.speed.measure import measure

_ROWS = {
    "single_ns": "one run, in a lane of its own",
    "single_xla_ns": "one run, by XLA",
    "batch_float64_one_thread_ns": "many runs on one thread",
    "batch_float64_ns": "many runs on all threads",
    "batch_float32_ns": "the same in single precision",
    "gpu_float64_ns": "on the GPU, a thread each",
    "gpu_float32_ns": "the same in single precision",
    "gpu_float32_vmap_ns": "the same by XLA",
    "numpy_ns": "one run in plain NumPy",
}


def bench(as_json: bool) -> int:
    """Measure workload W1, and print a table or JSON."""
    console = wide_console()
    if as_json:
        found = interruptible(lambda: measure(lambda what, share: None))
        typer.echo(json.dumps({key: _short(value) for key, value in found.items()}, indent=1))
        return DONE
    with shares(console) as progress:
        found = interruptible(lambda: measure(progress))
    title = f"Workload W1: nanoseconds per tick and run, {found['lanes']} lanes, {found['threads']} threads"
    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column("what")
    table.add_column("ns", justify="right")
    table.add_column("times NumPy", justify="right")
    for key, words in _ROWS.items():
        if key in found:
            table.add_row(words, f"{found[key]:.4g}", f"{found['numpy_ns'] / found[key]:.3g}")
    console.print(table)
    compiling = f"lanes {found['single_compile_s']:.2g} s, XLA {found['single_xla_compile_s']:.2g} s"
    console.print(f"Made ready in: {compiling}. Tracking rms {found['tracking_rms']:.6f}.", highlight=False)
    first = f"{found['first_cold_s']:.2g} s, {found['first_kept_s']:.2g} s with compiled code from before"
    console.print(f"From the start of a process to its first result: {first}.", highlight=False)
    return DONE


def _short(value: float | str) -> float | str:
    return float(f"{value:.6g}") if isinstance(value, float) else value
