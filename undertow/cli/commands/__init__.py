"""The commands, as `undertow --help` groups them; each with the options that it has and the function that it runs."""

from undertow.cli.commands import deploy, fit, inspection, paper, start, understand
from undertow.cli.commands.command import Command

GROUPS: dict[str, tuple[type[Command], ...]] = {
    "Start": start.COMMANDS,
    "Understand": understand.COMMANDS,
    "Fit": fit.COMMANDS,
    "Deploy": deploy.COMMANDS,
    "Paper": paper.COMMANDS,
    "Inspect": inspection.COMMANDS,
}
