"""Options of `undertow version`."""

import dataclasses
from typing import ClassVar

from undertow.cli.options.command import Command


@dataclasses.dataclass(frozen=True)
class VersionCommand(Command):
    """Show the versions of undertow, its dependencies and Python."""

    runs: ClassVar = "undertow.cli.version:version"
