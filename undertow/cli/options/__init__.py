"""The commands, as `undertow --help` groups them; each with the options that it has and the function that it runs."""

from undertow.cli.options.analyze import AnalyzeCommand
from undertow.cli.options.ardupilot import ArdupilotCommand
from undertow.cli.options.arena import ArenaCommand
from undertow.cli.options.bench import BenchCommand
from undertow.cli.options.campaign import CampaignCommand
from undertow.cli.options.check import CheckCommand
from undertow.cli.options.command import Command
from undertow.cli.options.compare import CompareCommand
from undertow.cli.options.describe import DescribeCommand, ListCommand
from undertow.cli.options.export import ExportCommand
from undertow.cli.options.falsify import FalsifyCommand
from undertow.cli.options.identify import IdentifyCommand
from undertow.cli.options.identify_design import IdentifyDesignCommand
from undertow.cli.options.init import InitCommand
from undertow.cli.options.logs import LogsCommand
from undertow.cli.options.mavlink import MavlinkCommand
from undertow.cli.options.reproduce import ReproduceCommand
from undertow.cli.options.ros2 import Ros2Command
from undertow.cli.options.run import RunCommand
from undertow.cli.options.simulate import SimulateCommand
from undertow.cli.options.tune import TuneCommand
from undertow.cli.options.version import VersionCommand

GROUPS: dict[str, tuple[type[Command], ...]] = {
    "Start": (InitCommand, SimulateCommand),
    "Understand": (AnalyzeCommand, CampaignCommand, CompareCommand, FalsifyCommand, ArenaCommand),
    "Fit": (IdentifyCommand, IdentifyDesignCommand, TuneCommand),
    "Deploy": (ExportCommand, RunCommand, Ros2Command, MavlinkCommand, ArdupilotCommand),
    "Paper": (ReproduceCommand,),
    "Inspect": (ListCommand, DescribeCommand, CheckCommand, LogsCommand, BenchCommand, VersionCommand),
}
