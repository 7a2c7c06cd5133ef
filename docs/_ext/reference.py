"""Directives that make the reference from the code: parts, keys of files, metrics, signals, exit codes and commands."""

import abc
from typing import Any

import typer
from blocks import paragraph, paragraphs, section, table
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from undertow.analysis.metrics import MEANINGS, PER_AXIS
from undertow.cli.exit_codes import MEANINGS as EXIT_CODES
from undertow.cli.main import app as command_line
from undertow.control.supervision.conditions import CONDITIONS, HEAD, State
from undertow.core import catalogue
from undertow.core.status import Status
from undertow.physics.faults.kinds import list_kinds, severity_cells
from undertow.scenario import describing
from undertow.scenario.describing import Description, text_of
from undertow.scenario.schema import Scenario
from undertow.scenario.schema_keys import keys
from undertow.simulation.loop.recorded_signals import RECORDED
from undertow.studies.campaign.campaign_schema import SECTIONS, Campaign

_PARAMETERS = ("parameter", "value", "unit", "symbol", "meaning", "source")


class FromCode(SphinxDirective, abc.ABC):
    """What is made from the code; its page is read again in every build."""

    def run(self) -> list[nodes.Node]:
        self.env.note_reread()
        return self.contents()

    @abc.abstractmethod
    def contents(self) -> list[nodes.Node]:
        """The nodes that stand in the place of the directive."""


class Parts(FromCode):
    """Every part of a kind, as `undertow describe` has it: options, parameters with units and sources, signals."""

    required_arguments = 1

    def contents(self) -> list[nodes.Node]:
        (kind,) = self.arguments
        names = sorted(catalogue.names(kind))
        return [described(one) for name in names for one in describing.describe(f"{kind}/{name}")]


def described(part: Description) -> nodes.section:
    """The section of one part, or of one preset of it."""
    title = f"`{part.name}`, preset `{part.preset}`" if part.preset else f"`{part.name}`"
    found = section(title, title, *paragraphs(part.summary))
    if part.options:
        rows = [(option.name, text_of(option.default), option.meaning) for option in part.options]
        found += [_caption("Options"), table(("option", "default", "meaning"), rows, ("option", "default"))]
    if part.parameters:
        rows = [(p.name, text_of(p.value), p.unit, p.symbol, p.meaning, p.source) for p in part.parameters]
        found += [_caption("Parameters"), table(_PARAMETERS, rows, ("parameter", "value"))]
    if part.signals:
        found += [_caption("Signals"), _signals(part.signals)]
    found += [paragraph(f"Advice: {sentence}") for sentence in part.advice]
    return found


class Keys(FromCode):
    """Every key of a scenario or a campaign file."""

    required_arguments = 1

    def contents(self) -> list[nodes.Node]:
        if self.arguments == ["scenario"]:
            return [_keys(Scenario)]
        each = [section(f"Keys of {name}", f"keys of {name}", _keys(model)) for name, model in SECTIONS.items()]
        return [_keys(Campaign), *each]


def _keys(model: Any) -> nodes.table:
    rows = [(key.path, key.type, text_of(key.default), key.meaning) for key in keys(model)]
    return table(("key", "type", "default", "meaning"), rows, ("key", "default"))


class FaultKinds(FromCode):
    """Every pair of target and mode of a fault, with the meaning of its severity."""

    def contents(self) -> list[nodes.Node]:
        rows = [(one.target, one.mode, *severity_cells(one)) for one in list_kinds()]
        return [table(("target", "mode", "severity", "unit", "default", "range"), rows, ("target", "mode"))]


class Metrics(FromCode):
    """Metrics of a run."""

    def contents(self) -> list[nodes.Node]:
        unit = lambda metric: metric.unit.replace("[axis]", "[output]")
        rows = [(name, unit(one), PER_AXIS.get(name, ""), one.meaning) for name, one in MEANINGS.items()]
        return [table(("metric", "unit", "of each output", "meaning"), rows, ("metric", "of each output"))]


class Signals(FromCode):
    """Signals of every run."""

    def contents(self) -> list[nodes.Node]:
        return [_signals(RECORDED)]


def _signals(declared: Any) -> nodes.table:
    rows = [(name, ", ".join(("time", *one.dimensions)), one.unit, one.meaning) for name, one in declared.items()]
    return table(("signal", "dimensions", "unit", "meaning"), rows, ("signal",))


class Statuses(FromCode):
    """How a run can end."""

    def contents(self) -> list[nodes.Node]:
        return [table(("status", "meaning"), [(one.word, one.sentence) for one in Status], ("status",))]


class ExitCodes(FromCode):
    """Exit codes of every command."""

    def contents(self) -> list[nodes.Node]:
        return [table(("code", "meaning"), [(str(code), meaning) for code, meaning in EXIT_CODES.items()], ("code",))]


class Commands(FromCode):
    """Arguments and options of every command."""

    def contents(self) -> list[nodes.Node]:
        main: Any = typer.main.get_command(command_line)
        return [_command(f"undertow {name}", command) for name, command in main.commands.items()]


class SupervisorStates(FromCode):
    """States of the supervisor."""

    def contents(self) -> list[nodes.Node]:
        return [table(("state", "meaning"), [(one.name, one.meaning) for one in State], ("state",))]


class SupervisorConditions(FromCode):
    """The table of the supervisor: conditions, limits, times and reactions."""

    def contents(self) -> list[nodes.Node]:
        return [table(HEAD, [one.cells() for one in CONDITIONS], ("reason",))]


def _command(name: str, command: Any) -> nodes.section:
    usage = " ".join([name, *command.collect_usage_pieces(command.make_context(name, [], resilient_parsing=True))])
    found = section(f"`{name}`", name, nodes.literal_block(usage, usage), *paragraphs(command.help))
    given = [
        (one.metavar or one.name.upper(), one.help or "") for one in command.params if one.param_type_name == "argument"
    ]
    if given:
        found += table(("argument", "meaning"), given, ("argument",))
    options = [
        (", ".join((*one.opts, *one.secondary_opts)) + f" {one.metavar}" * bool(one.metavar), one.help or "")
        for one in command.params
        if one.param_type_name == "option"
    ]
    if options:
        found += table(("option", "meaning"), options, ("option",))
    return found


def _caption(text: str) -> nodes.paragraph:
    return nodes.paragraph("", "", nodes.strong(text, text))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    found = {"parts": Parts, "keys": Keys, "metrics": Metrics, "signals": Signals, "fault-kinds": FaultKinds}
    found |= {"supervisor-states": SupervisorStates, "supervisor-conditions": SupervisorConditions}
    for name, directive in (found | {"statuses": Statuses, "exit-codes": ExitCodes, "commands": Commands}).items():
        app.add_directive(name, directive)
    return {"parallel_read_safe": True}
