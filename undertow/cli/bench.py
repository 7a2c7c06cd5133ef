"""`undertow bench`: measure the speed on this machine."""

import json
from typing import Any

import typer
from rich.table import Table

from undertow.cli.exit_codes import DONE
from undertow.cli.interruptible import interruptible
from undertow.cli.options.bench import BenchCommand
from undertow.cli.stages import shares
from undertow.cli.tables import numbers, titled, wide_console
from undertow.studies.speed.measure import measure
from undertow.studies.speed.waiting import waiting_times

_ROWS = {
    "single_ns": "one run, SIMD backend",
    "single_xla_ns": "one run, XLA backend",
    "batch_float64_one_thread_ns": "batch on one thread",
    "batch_float64_ns": "batch on all threads",
    "batch_float32_ns": "batch on all threads, single precision",
    "gpu_float64_ns": "batch on the GPU",
    "gpu_float32_ns": "batch on the GPU, single precision",
    "gpu_float32_vmap_ns": "batch on the GPU, single precision, XLA backend",
    "numpy_ns": "one run in plain NumPy",
}
# Title of each workload, and the prefix of its keys.
_WORKLOADS = {
    "W1, ODIN with eight full motor models, 1 kHz": "",
    "W2, BlueROV2 Heavy in current and waves, 100 Hz": "w2_",
}


def bench(command: BenchCommand) -> int:
    """Measure workloads W1 and W2, or how long users wait, and print tables or JSON."""
    console = wide_console()
    work = waiting_times if command.users else measure
    if command.as_json:
        figures = interruptible(lambda: work(lambda what, share: None))
        typer.echo(json.dumps({key: _short(value) for key, value in figures.items()}, indent=1))
        return DONE
    with shares(console) as progress:
        figures = interruptible(lambda: work(progress))
    if command.users:
        console.print(_waiting_table(figures))
        return DONE
    if "simd_unavailable" in figures:
        console.print(f"Figures of SIMD batches are left out: {figures['simd_unavailable']}.", highlight=False)
    for words, prefix in _WORKLOADS.items():
        if f"{prefix}steps" not in figures:
            continue
        console.print(_table(words, figures, prefix))
        if f"{prefix}single_compile_s" not in figures:
            continue
        compiling = f"{figures[f'{prefix}single_compile_s']:.2g} s for one run"
        if f"{prefix}single_xla_compile_s" in figures:
            compiling += f" (XLA {figures[f'{prefix}single_xla_compile_s']:.2g} s)"
        compiling += f", {figures[f'{prefix}batch_float64_compile_s']:.2g} s for a batch"
        details = (
            f"{figures[f'{prefix}batch_float64_operations']} operations per step, "
            f"rms of all six errors {figures[f'{prefix}tracking_rms']:.6f}"
        )
        console.print(f"Compile time: {compiling}; {details}.", highlight=False)
    first = f"{figures['first_cold_s']:.2g} s without cached code, {figures['first_kept_s']:.2g} s with it"
    console.print(f"Time from the start of a process to its first result (W1): {first}.", highlight=False)
    return DONE


def _waiting_table(figures: dict[str, Any]) -> Table:
    """Seconds that commands take, and how many times as long as the start of JAX that is."""
    table = titled("Seconds that users wait", "command", *map(numbers, ("s", "times the start of JAX")))
    for key, value in figures.items():
        table.add_row(key.removesuffix("_s").replace("_", " "), f"{value:.3g}", f"{value / figures['jax_start_s']:.3g}")
    return table


def _table(words: str, figures: dict[str, Any], prefix: str) -> Table:
    """One workload, with ratios to plain NumPy where that was measured."""
    steps = f"{figures[f'{prefix}steps']} steps, SIMD width {figures['simd_width']}, {figures['threads']} threads"
    has_numpy = f"{prefix}numpy_ns" in figures
    columns = map(numbers, ("ns", "speed-up over NumPy") if has_numpy else ("ns",))
    table = titled(f"{words}: nanoseconds per step and run ({steps})", "execution", *columns)
    for key, row in _ROWS.items():
        if (value := figures.get(f"{prefix}{key}")) is not None:
            ratio = (f"{figures[f'{prefix}numpy_ns'] / value:.3g}",) if has_numpy else ()
            table.add_row(row, f"{value:.4g}", *ratio)
    return table


def _short(value: float | str) -> float | str:
    return float(f"{value:.6g}") if isinstance(value, float) else value
