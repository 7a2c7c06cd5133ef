"""`undertow soak`: attack undertow itself, count, and report."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from undertow.cli import exit_codes
from undertow.soak.inputs import BUILD


class _Build:
    """A command that reads, validates and builds a scenario."""

    def main(self, args: Sequence[str], **settings: Any) -> int:
        """Build the scenario that is the second word."""
        from undertow.scenario.build import build
        from undertow.scenario.reading import read

        build(read(Path(args[1])))
        return exit_codes.DONE


def attacked(arguments: Sequence[str]) -> int:
    """Run `undertow` with arguments in this process, or build a scenario, with the guard of the command line."""
    from undertow.cli.main import run

    return exit_codes.run_guarded(_Build(), arguments) if arguments[:1] == (BUILD,) else run(arguments)
