"""The command line `undertow`: arguments and help. Each command is in its own file, imported when it runs."""

import contextlib
import importlib.metadata
import os
import platform
import sys
import threading
import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from undertow.cli import outside_commands
from undertow.cli.exit_codes import run_guarded
from undertow.cli.interruptible import remember_interrupts
from undertow.cli.options import AllowCode, Pdf, Replay, ScenarioFile
from undertow.cli.soak import soak
from undertow.process_setup import prepare

app = typer.Typer(name="undertow", add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


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


@app.command()
def reproduce(
    out: Annotated[
        Path,
        typer.Option(
            metavar="DIR", help="Folder for the report. It is created if missing; an earlier report is replaced."
        ),
    ] = Path("reproduction"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Skip the parameter sweeps. The other results stay the same.")
    ] = False,
    pdf: Pdf = None,
) -> None:
    """Reproduce the paper.

    The command computes every figure and table of the paper, checks its claims, and writes two HTML pages,
    DIR/report.html and DIR/ablations.html.
    """
    from undertow.cli.reproduce import reproduce

    reproduce(out, quick, pdf)


@app.command()
def init(
    path: Annotated[
        Path,
        typer.Argument(metavar="[PATH]", help="Folder for scenario.yaml, or a name that ends in .yaml. Default: here."),
    ] = Path(),
    vehicle: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Vehicle: bluerov2, bluerov2_heavy (default), odin, rexrov, or a vehicle file of your own.",
        ),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(metavar="FILE.py:FUNCTION", help="Controller of your own. Default: pid.")
    ] = None,
    own_vehicle: Annotated[
        bool, typer.Option("--own-vehicle", help="Also write my_rov.yaml, a vehicle file for your numbers.")
    ] = False,
    own_controller: Annotated[
        bool, typer.Option("--own-controller", help="Also write my_controller.py, a sliding-mode law to change.")
    ] = False,
) -> None:
    """Write a commented scenario to start from.

    The command writes scenario.yaml and scenario.schema.json, with which editors complete and explain its keys. The
    scenario runs as it is: `undertow simulate scenario.yaml`. Existing files are not changed.
    """
    from undertow.cli.init import init

    init(path, vehicle, controller, own_vehicle, own_controller)


@app.command()
def simulate(
    scenario: ScenarioFile,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for the results. Default: runs/NAME for NAME.yaml, or the next free runs/NAME-2, ...",
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier result in DIR, which is an error otherwise.")
    ] = False,
    prediction: Annotated[
        bool | None,
        typer.Option(
            "--prediction/--no-prediction",
            help="Also predict the steady-state metrics from the linearised closed loop and compare. Default: where "
            "the run can have a prediction; --prediction says why it has none.",
            show_default=False,
        ),
    ] = None,
    allow_code: AllowCode = False,
    pdf: Pdf = None,
    video: Annotated[
        Path | None,
        typer.Option(metavar="FILE.mp4", help="Also write a video of the run, at most 30 s long. It needs ffmpeg."),
    ] = None,
    rerun: Annotated[
        Path | None,
        typer.Option(metavar="FILE.rrd", help="Also write the run for the viewer Rerun. It needs the extra `viz`."),
    ] = None,
) -> int:
    """Simulate one scenario.

    The command writes run.nc, metrics.json, scenario.yaml, run.mcap, figures/ and run.html when the run has ended.
    run.mcap holds the series for Foxglove and other viewers. run.html holds metrics, figures and a replay in three
    dimensions, and needs no network. If SCENARIO is a result file, its run is repeated, and the command reports whether
    the results are identical bit for bit. Other files in DIR are not changed.
    """
    from undertow.cli.simulate import simulate

    return simulate(scenario, out, overwrite, prediction, allow_code, pdf, video, rerun)


@app.command()
def bench(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
    users: Annotated[
        bool, typer.Option("--users", help="Measure how long commands take, with empty caches and after a change.")
    ] = False,
) -> int:
    """Measure the speed of undertow on this machine, compared with plain NumPy.

    The workloads are W1 (ODIN with eight full motor models under the paper's controller, 1 kHz) and W2 (BlueROV2 Heavy
    in current and waves, 100 Hz). The command takes some minutes, most of them for compiling. With `--users` it
    measures how many seconds `simulate` and `compare` take to print their results and to write their files.
    """
    from undertow.cli.bench import bench

    return bench(as_json, users)


@app.command()
def tune(
    scenario: ScenarioFile,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the results. Default: runs/NAME-tuned, or the next free one."),
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="search (differential evolution); gradient (quasi-Newton); or evolution (mutation and selection "
            "around the best gains, for few evaluations).",
        ),
    ] = "search",
    budget: Annotated[
        float, typer.Option(metavar="SECONDS", help="Time budget of the whole command, compiling included.")
    ] = 240.0,
    resume: Annotated[bool, typer.Option("--resume", help="Continue an interrupted tuning.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier result in DIR.")] = False,
    allow_code: AllowCode = False,
    pdf: Pdf = None,
) -> int:
    """Tune the gains of a controller.

    The command simulates the closed loop with many candidate gains on a training set of seeds, disturbance sizes and
    published parameter sets, and evaluates the best on held-out runs, where the given gains are kept unless these are
    better. It accepts only gains with a certificate of stability. It writes tuned.yaml (a scenario with the gains),
    tuning.json and figures/. The section `tune` of the scenario has the options.
    """
    started = time.perf_counter()
    from undertow.cli.tune import tune_scenario

    return tune_scenario(scenario, out, method, budget, resume, overwrite, allow_code, pdf, started)


@app.command()
def falsify(
    scenario: ScenarioFile,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the results. Default: runs/NAME-falsified, or the next free one."),
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="gradient (by differentiation where possible, and search), or search (without differentiation).",
        ),
    ] = "gradient",
    budget: Annotated[int, typer.Option(metavar="RUNS", help="Largest number of runs.")] = 2000,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the search, not of the runs.")] = 0,
    resume: Annotated[bool, typer.Option("--resume", help="Continue an interrupted falsification.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier result in DIR.")] = False,
    allow_code: AllowCode = False,
    pdf: Pdf = None,
) -> int:
    """Find the smallest departure from a scenario, within bounds, that breaks a requirement.

    The section `falsify` of the scenario gives the bounds of what varies, and `requirements` what every run must keep.
    The command first breaks a requirement, then shrinks the departure that broke it. It writes falsify.json, figures/
    and counterexample.yaml, a scenario with which `undertow simulate` repeats the failure.
    """
    from undertow.cli.falsify import falsify_scenario

    return falsify_scenario(scenario, out, method, budget, seed, resume, overwrite, allow_code, pdf)


@app.command()
def analyze(
    scenario: ScenarioFile,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the page. Default: runs/NAME-prediction, or the next free one."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier prediction in DIR.")] = False,
    allow_code: AllowCode = False,
    pdf: Pdf = None,
) -> int:
    """Predict closed-loop performance and stability margins without simulating.

    The command linearises the whole closed loop at its equilibrium and reports the poles over the operating range, the
    sampling limit, the delay and lag margins, the response to noise and disturbances, and the actuator authority. It
    writes prediction.html, prediction.json and figures/.
    """
    from undertow.cli.analyze import analyze

    return analyze(scenario, out, overwrite, allow_code, pdf)


@app.command()
def campaign(
    campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN", help="A .yaml file, or the word `status`.")],
    folder: Annotated[
        Path | None, typer.Argument(metavar="[DIR]", help="After `status`: the folder of a campaign.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the results. Default: runs/NAME, or the next free one."),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Resume the campaign in DIR: run unfinished trials, and new ones if `trials` was increased.",
        ),
    ] = False,
    workers: Annotated[
        int | None, typer.Option(metavar="N", help="Number of threads or workers. Default: all cores.")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(metavar="WHERE", help="Dask cluster: local, slurm, ssh, or the address of a scheduler."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier campaign in DIR.")] = False,
    allow_code: AllowCode = False,
    pdf: Pdf = None,
    replay: Replay = False,
) -> int:
    """Run a Monte Carlo study or a parameter sweep of one scenario.

    The command writes trials.zarr, campaign.html, summary.json, figures/ and the scenarios of the worst trials. After
    Ctrl-C, kill -9 or a full disk, --resume continues without loss. `undertow campaign status DIR` prints the progress.
    """
    from undertow.cli import campaign as command

    if str(campaign) == "status":
        given = {"--out": out, "--resume": resume, "--workers": workers, "--cluster": cluster, "--overwrite": overwrite}
        given |= {"--allow-code": allow_code, "--pdf": pdf, "--replay": replay}
        return command.status(folder or Path(), [name for name, value in given.items() if value])
    if folder is not None:
        command.refuse_second(folder)
    return command.campaign(campaign, out, resume, workers, cluster, overwrite, allow_code, pdf, replay)


@app.command()
def compare(
    scenarios: Annotated[
        list[Path], typer.Argument(metavar="SCENARIO...", help="A .yaml file, several of them, or one campaign file.")
    ],
    controllers: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="What to compare on one scenario, separated by commas: presets (robust, paper), controllers (pid), "
            "./file.py:function, scenario files whose controller is taken (tuned.yaml), and the word `scenario` for "
            "the scenario's own controller. NAME=ENTRY gives a name.",
        ),
    ] = None,
    trials: Annotated[
        int | None, typer.Option(metavar="N", help="Trials of each. Default: 20, or the number of the campaign file.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for the results. Default: runs/NAME-comparison, or the next free one."
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted comparison, or add trials.")
    ] = False,
    workers: Annotated[int | None, typer.Option(metavar="N", help="Number of threads. Default: all cores.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier comparison in DIR.")] = False,
    allow_code: AllowCode = False,
    pdf: Pdf = None,
    replay: Replay = False,
    tune: Annotated[
        int | None,
        typer.Option(
            metavar="EVALUATIONS",
            help="Tune the gains of every controller first, with this number of evaluations for each, at least 12. The "
            "trials then have held-out seeds, parameter sets and wave heights.",
        ),
    ] = None,
) -> int:
    """Compare controllers on one scenario, or several scenarios, on the same seeds.

    The command runs all of them on the same samples and seeds. It reports the medians, the paired differences with
    confidence intervals and a rank test, the Pareto fronts of error against effort, the computing time of a step, and
    the failures. It writes comparison.html, .json, .csv, .tex and .md, step_times.json, figures/, trials.zarr, and
    scenarios/ with the scenario of each controller.
    """
    from undertow.cli.compare import compare

    return compare(scenarios, controllers, trials, out, resume, workers, overwrite, allow_code, pdf, replay, tune)


@app.command()
def arena(
    controllers: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[CONTROLLER...]",
            help="Laws that enter: presets (robust), controllers (pid), ./file.py:function, scenario files whose "
            "controller is taken (tuned.yaml); NAME=ENTRY gives a name. Default: all of undertow but nmpc.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the results of all laws. Default: runs/arena.")
    ] = None,
    trials: Annotated[int, typer.Option(metavar="N", help="Trials of every task on every vehicle.")] = 8,
    tasks: Annotated[str | None, typer.Option(metavar="LIST", help="Some of the tasks only.")] = None,
    vehicles: Annotated[str | None, typer.Option(metavar="LIST", help="Some of the vehicles only.")] = None,
    tune: Annotated[
        int | None,
        typer.Option(
            metavar="EVALUATIONS",
            help="Tune the gains of every law for every vehicle first, with this number of evaluations, at least 12, "
            "on a motion, a sea and parameter sets that no task has.",
        ),
    ] = None,
    robustness: Annotated[
        bool, typer.Option("--robustness", help="Also compute the error over ten parameters until a law fails.")
    ] = False,
    workers: Annotated[int | None, typer.Option(metavar="N", help="Number of threads. Default: all cores.")] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the results of the named laws in DIR.")
    ] = False,
    pdf: Pdf = None,
) -> int:
    """Run control laws through fixed tasks on four vehicles, and write the leader board.

    The fifteen tasks reach from station keeping in waves to the models of other publications. Results of other laws
    in DIR stay, trials that are there are not repeated, and the same command continues after an interruption. A law of
    your own enters by `undertow arena ./mine.py:law`. The command writes leaderboard.html, .json, .csv and .md,
    figures/ and laws/, which has the scenario of every task.
    """
    from undertow.cli.arena import arena

    return arena(controllers or [], out, trials, tasks, vehicles, tune, robustness, workers, overwrite, pdf)


for command in (*outside_commands.ALL, soak):
    app.command()(command)


@app.command("list")
def list_parts(
    kind: Annotated[str | None, typer.Argument(metavar="[KIND]", help="One kind only, e.g. thrusters.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a table: with faults every target and mode.")
    ] = False,
) -> None:
    """List the available parts.

    Kinds: vehicles, thrusters, power, plants, controllers, disturbances, references, sensors, navigation, faults.
    `undertow list faults` shows every pair of target and mode, with the meaning of its severity.
    """
    from undertow.cli.describe import list_parts

    list_parts(kind, as_json)


@app.command()
def describe(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A part (see `undertow list`), ./file.py:function, a vehicle file, or one of the words scenario, "
            "campaign, metrics and signals.",
        ),
    ],
    json_schema: Annotated[
        bool,
        typer.Option("--json-schema", help="With NAME scenario or campaign: print the JSON schema that editors use."),
    ] = False,
) -> None:
    """Describe a part.

    The command shows the options of the part, its parameters with unit, symbol and source, and advice. `describe
    scenario` shows the keys of a scenario file, `describe campaign` those of a campaign file, `describe metrics` the
    metrics with their units.
    """
    from undertow.cli.describe import describe

    describe(name, json_schema)


@app.command()
def check(
    thing: Annotated[
        str,
        typer.Argument(
            metavar="THING", help="A vehicle file, a scenario, a campaign, a part by name, or ./file.py:function."
        ),
    ],
    option: Annotated[
        list[str] | None,
        typer.Option(
            "--option", metavar="KEY=VALUE", help="Option of the part, for example parameters=wu2018. Repeatable."
        ),
    ] = None,
    allow_code: AllowCode = False,
) -> int:
    """Check a vehicle, another part, a scenario or a campaign.

    The command reports errors and advice, each with the numbers that caused it, and quantities derived from the
    parameters. The exit code is 2 if there are errors.
    """
    from undertow.cli.check import check

    return check(thing, option or [], allow_code)


@app.command()
def version() -> None:
    """Show the versions of undertow, its dependencies and Python."""
    for package in ("undertow", "jax", "jaxlib", "equinox", "diffrax", "numpy", "xarray"):
        typer.echo(f"{package} {importlib.metadata.version(package)}")
    typer.echo(f"python {platform.python_version()}")


def run(arguments: Sequence[str]) -> int:
    """Run `undertow` with these arguments and return the exit code; output goes to stdout and stderr."""
    return run_guarded(typer.main.get_command(app), arguments)


def main() -> None:
    """Entry point of the `undertow` command."""
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
