"""`python -m soak`, from the folder of the repository."""

from collections.abc import Sequence

import typer

from soak.options import SoakCommand
from undertow.cli.exit_codes import run_guarded
from undertow.cli.main import main

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
app.command(SoakCommand.word())(SoakCommand.callback())


def run(arguments: Sequence[str]) -> int:
    """Attack undertow with these arguments and return the exit code."""
    return run_guarded(typer.main.get_command(app), arguments, "python -m soak")


if __name__ == "__main__":
    main(run)
