"""The command line `undertow`: its commands are declared in `commands`, and imported when they run."""

import contextlib
import importlib.metadata
import os
import sys
import threading
import warnings
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from undertow.cli.exit_codes import run_guarded
from undertow.cli.interruptible import remember_interrupts
from undertow.cli.options import GROUPS
from undertow.core.process_setup import prepare


class GroupedCommands(TyperGroup):
    """The commands, of which `--help` shows the groups."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the sections of the help."""
        for title, commands in GROUPS.items():
            rows = [(command.word(), command.sentence()) for command in commands]
            with formatter.section(title):
                formatter.write_dl(rows)


app = typer.Typer(
    name="undertow", cls=GroupedCommands, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)


@app.callback(invoke_without_command=True)
def undertow(
    context: typer.Context,
    traceback: Annotated[bool, typer.Option("--traceback", help="Show the traceback of an error.")] = False,
    short_version: Annotated[bool, typer.Option("--version", help="Show the version of undertow.")] = False,
) -> None:
    """Simulate, analyse and tune robust adaptive control of underwater vehicles with voltage-driven thrusters.

    Exit codes: 0 done; 1 done, but a run failed; 2 bad input; 3 internal error; 4 files could not be read or written;
    130 interrupted by Ctrl-C; 143, 129 and 131 ended by SIGTERM, SIGHUP and SIGQUIT; 141 nobody reads the output.
    """
    if traceback:
        os.environ["UNDERTOW_TRACEBACK"] = "1"
    if short_version:
        typer.echo(f"undertow {importlib.metadata.version('undertow')}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


for commands in GROUPS.values():
    for command in commands:
        app.command(command.word())(command.callback())


def run(arguments: Sequence[str]) -> int:
    """Run `undertow` with these arguments and return the exit code; output goes to stdout and stderr."""
    return run_guarded(typer.main.get_command(app), arguments)


def main(run: Callable[[Sequence[str]], int] = run) -> None:
    """Entry point of the `undertow` command, or of another program that runs as it does."""
    if not os.environ.get("UNDERTOW_TRACEBACK"):
        warnings.simplefilter("ignore")
    remember_interrupts()
    prepare()
    code = run(sys.argv[1:])
    # A thread in compiled code, or compiling, cannot be stopped otherwise; and JAX would clear its caches for a quarter
    # of a second. A profiler writes its findings on the usual way out.
    if threading.active_count() > 1 or sys.getprofile() is None:
        with contextlib.suppress(OSError):  # a full disk
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
