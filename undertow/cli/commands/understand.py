"""Commands that say what a controller does, and where it fails."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.commands.command import Command
from undertow.cli.commands.options import AllowCode, Overwrite, Pdf, Replay, Resume, ScenarioFile, Workers, results


@dataclasses.dataclass(frozen=True)
class AnalyzeCommand(Command):
    """Predict closed-loop performance and stability margins without simulating.

    The command linearises the whole closed loop at its equilibrium and reports the poles over the operating range, the
    sampling limit, the delay and lag margins, the response to noise and disturbances, and the actuator authority. It
    writes prediction.html, prediction.json and figures/.
    """

    runs: ClassVar = "undertow.cli.analyze:analyze"
    scenario: ScenarioFile
    out: Annotated[Path | None, results("runs/NAME-prediction")] = None
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None


@dataclasses.dataclass(frozen=True)
class CampaignCommand(Command):
    """Run a Monte Carlo study or a parameter sweep of one scenario.

    The command writes trials.zarr, campaign.html, summary.json, figures/ and the scenarios of the worst trials. After
    Ctrl-C, kill -9 or a full disk, --resume continues without loss. `undertow campaign status DIR` prints the progress.
    """

    runs: ClassVar = "undertow.cli.campaign:campaign"
    campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN", help="A .yaml file, or the word `status`.")]
    folder: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="After `status`: the folder of a campaign.")
    ] = None
    out: Annotated[Path | None, results("runs/NAME")] = None
    resume: Resume = False
    workers: Workers = None
    cluster: Annotated[
        str | None,
        typer.Option(metavar="WHERE", help="Dask cluster: local, slurm, ssh, or the address of a scheduler."),
    ] = None
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None
    replay: Replay = False


@dataclasses.dataclass(frozen=True)
class CompareCommand(Command):
    """Compare controllers on one scenario, or several scenarios, on the same seeds.

    The command runs all of them on the same samples and seeds. It reports the medians, the paired differences with
    confidence intervals and a rank test, the Pareto fronts of error against effort, the computing time of a step, and
    the failures. It writes comparison.html, .json, .csv, .tex and .md, step_times.json, figures/, trials.zarr, and
    scenarios/ with the scenario of each controller.
    """

    runs: ClassVar = "undertow.cli.compare:compare"
    scenarios: Annotated[
        list[Path], typer.Argument(metavar="SCENARIO...", help="A .yaml file, several of them, or one campaign file.")
    ]
    controllers: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="What to compare on one scenario, separated by commas: presets (robust, paper), controllers (pid), "
            "./file.py:function, scenario files whose controller is taken (tuned.yaml), and the word `scenario` for "
            "the scenario's own controller. NAME=ENTRY gives a name.",
        ),
    ] = None
    trials: Annotated[
        int | None, typer.Option(metavar="N", help="Trials of each. Default: 20, or the number of the campaign file.")
    ] = None
    out: Annotated[Path | None, results("runs/NAME-comparison")] = None
    resume: Resume = False
    workers: Workers = None
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None
    replay: Replay = False
    tune: Annotated[
        int | None,
        typer.Option(
            metavar="EVALUATIONS",
            help="Tune the gains of every controller first, with this number of evaluations for each, at least 12. The "
            "trials then have held-out seeds, parameter sets and wave heights.",
        ),
    ] = None


@dataclasses.dataclass(frozen=True)
class FalsifyCommand(Command):
    """Find the smallest departure from a scenario, within bounds, that breaks a requirement.

    The section `falsify` of the scenario gives the bounds of what varies, and `requirements` what every run must keep.
    The command first breaks a requirement, then shrinks the departure that broke it. It writes falsify.json, figures/
    and counterexample.yaml, a scenario with which `undertow simulate` repeats the failure.
    """

    runs: ClassVar = "undertow.cli.falsify:falsify_scenario"
    named: ClassVar = "falsify"
    scenario: ScenarioFile
    out: Annotated[Path | None, results("runs/NAME-falsified")] = None
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="gradient (by differentiation where possible, and search), or search (without differentiation).",
        ),
    ] = "gradient"
    budget: Annotated[int, typer.Option(metavar="RUNS", help="Largest number of runs.")] = 2000
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the search, not of the runs.")] = 0
    resume: Resume = False
    overwrite: Overwrite = False
    allow_code: AllowCode = False
    pdf: Pdf = None


@dataclasses.dataclass(frozen=True)
class ArenaCommand(Command):
    """Run control laws through fixed tasks on four vehicles, and write the leader board.

    The fifteen tasks reach from station keeping in waves to the models of other publications. Results of other laws
    in DIR stay, trials that are there are not repeated, and the same command continues after an interruption. A law of
    your own enters by `undertow arena ./mine.py:law`. The command writes leaderboard.html, .json, .csv and .md,
    figures/ and laws/, which has the scenario of every task.
    """

    runs: ClassVar = "undertow.cli.arena:arena"
    controllers: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[CONTROLLER...]",
            help="Laws that enter: presets (robust), controllers (pid), ./file.py:function, scenario files whose "
            "controller is taken (tuned.yaml); NAME=ENTRY gives a name. Default: all of undertow but nmpc.",
        ),
    ] = None
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the results of all laws. Default: runs/arena.")
    ] = None
    trials: Annotated[int, typer.Option(metavar="N", help="Trials of every task on every vehicle.")] = 8
    tasks: Annotated[str | None, typer.Option(metavar="LIST", help="Some of the tasks only.")] = None
    vehicles: Annotated[str | None, typer.Option(metavar="LIST", help="Some of the vehicles only.")] = None
    tune: Annotated[
        int | None,
        typer.Option(
            metavar="EVALUATIONS",
            help="Tune the gains of every law for every vehicle first, with this number of evaluations, at least 12, "
            "on a motion, a sea and parameter sets that no task has.",
        ),
    ] = None
    robustness: Annotated[
        bool, typer.Option("--robustness", help="Also compute the error over ten parameters until a law fails.")
    ] = False
    workers: Workers = None
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the results of the named laws in DIR.")] = (
        False
    )
    pdf: Pdf = None


COMMANDS = (AnalyzeCommand, CampaignCommand, CompareCommand, FalsifyCommand, ArenaCommand)
