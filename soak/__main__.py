"""`python -m soak`, from the folder of the repository."""

import os
import sys
import warnings

from undertow.core.process_setup import prepare

prepare()

import typer

from soak.command import SoakCommand
from undertow.cli.exit_codes import run_guarded
from undertow.cli.interruptible import remember_interrupts

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
app.command("soak")(SoakCommand.callback())


def run(arguments: list[str]) -> int:
    """Attack undertow with these arguments and return the exit code."""
    return run_guarded(typer.main.get_command(app), arguments)


if __name__ == "__main__":
    if not os.environ.get("UNDERTOW_TRACEBACK"):
        warnings.simplefilter("ignore")
    remember_interrupts()
    sys.exit(run(sys.argv[1:]))
