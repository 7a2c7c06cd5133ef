"""`undertow`: what can be typed. The work is in one file per command, imported when the command runs."""

import os
import sys
import threading
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from undertow.cli.exit_codes import run_guarded
from undertow.cli.interruptible import remember_interrupts
from undertow.process import prepare

AllowCode = Annotated[
    bool, typer.Option("--allow-code", help="Run the Python code that a result file names; a .yaml file's always runs.")
]

app = typer.Typer(name="undertow", add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.callback(invoke_without_command=True)
def undertow(
    context: typer.Context,
    traceback: Annotated[bool, typer.Option("--traceback", help="Show where an error came from.")] = False,
) -> None:
    """Robust adaptive control of underwater vehicles, from volts to trajectory, that shows its own limits.

    Exit codes: 0 done; 1 done, but a run failed; 2 bad input; 3 internal error; 4 files could not be read or written;
    130 interrupted by Ctrl-C, 143 by SIGTERM.
    """
    if traceback:
        os.environ["UNDERTOW_TRACEBACK"] = "1"
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command()
def reproduce(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for the report, made if missing; an earlier one is replaced.")
    ] = Path("reproduction"),
    quick: Annotated[bool, typer.Option("--quick", help="Leave out sweeps. Accuracy stays.")] = False,
) -> None:
    """Reproduce the paper.

    Computes every figure and table, audits the claims, and writes one HTML page, DIR/report.html.
    """
    from undertow.cli.reproduce import reproduce

    reproduce(out, quick)


@app.command()
def simulate(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", help="A .yaml file, or an earlier run.nc.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for the results. Default: runs/NAME for NAME.yaml, or runs/NAME-2, ... if taken.",
        ),
    ] = None,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite", help="Replace an earlier result in DIR. Without it, DIR must not hold one."),
    ] = False,
    prediction: Annotated[
        bool,
        typer.Option("--prediction/--no-prediction", help="Whether to predict the steady metrics beside the run."),
    ] = True,
    allow_code: AllowCode = False,
) -> int:
    """Run one closed loop.

    Writes run.nc, metrics.json, scenario.yaml and figures/. A result file as SCENARIO repeats its run bit for bit, and
    says whether it did. Nothing is written unless the whole run was; files of other names in DIR stay as they are.
    """
    from undertow.cli.simulate import simulate

    return simulate(scenario, out, overwrite, prediction, allow_code)


@app.command()
def bench(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> int:
    """Measure how fast undertow is here, beside plain NumPy.

    Workloads W1 (ODIN with eight whole motors, the paper's law, 1 kHz) and W2 (BlueROV2 Heavy at sea, 100 Hz): some
    minutes, most of them compiling.
    """
    from undertow.cli.bench import bench

    return bench(as_json)


@app.command()
def tune(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", help="A .yaml file, or an earlier run.nc.")],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the results. Default: runs/NAME-tuned, or the next.")
    ] = None,
    method: Annotated[
        str, typer.Option(metavar="METHOD", help="gradient, or search: without slopes, for what is not smooth.")
    ] = "gradient",
    budget: Annotated[
        float, typer.Option(metavar="SECONDS", help="Time to take; compiling and a first look are always finished.")
    ] = 240.0,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with a tuning that was interrupted.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier result in DIR.")] = False,
    allow_code: AllowCode = False,
) -> int:
    """Find the gains of a controller.

    Runs the loop with many gains on a training set of seeds, sizes of the disturbance and published parameter sets;
    judges the best on other runs, and never gives gains without a certificate of stability. Writes tuned.yaml, which
    `undertow simulate` takes, tuning.json and figures/. The section `tune` of the scenario says more.
    """
    from undertow.cli.tune import tune_scenario

    return tune_scenario(scenario, out, method, budget, resume, overwrite, allow_code)


@app.command()
def analyze(
    scenario: Annotated[Path, typer.Argument(metavar="SCENARIO", help="A .yaml file, or an earlier run.nc.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the page. Default: runs/NAME-prediction, or the next free one."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier prediction in DIR.")] = False,
    allow_code: AllowCode = False,
) -> int:
    """Predict a closed loop before it is run.

    Linearises the whole loop exactly where it rests: poles over the operating range, how much sampling time, delay,
    lag and noise it bears, error against frequency, what the actuators can hold. Writes prediction.html,
    prediction.json and figures/.
    """
    from undertow.cli.analyze import analyze

    return analyze(scenario, out, overwrite, allow_code)


@app.command()
def campaign(
    campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN", help="A .yaml file; or the word `status`.")],
    folder: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="After `status`: of a campaign.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the results. Default: runs/NAME, or the next free one."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Fly what is missing of a campaign in DIR, or further trials.")
    ] = False,
    workers: Annotated[int | None, typer.Option(metavar="N", help="Threads or workers. Default: all cores.")] = None,
    cluster: Annotated[
        str | None, typer.Option(metavar="WHERE", help="Dask: local, slurm, ssh, or the address of a scheduler.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier campaign in DIR.")] = False,
    allow_code: AllowCode = False,
) -> int:
    """Fly one scenario thousands of times.

    Parameters are drawn or crossed, every trial has a seed of its own. Writes trials.zarr, campaign.html, summary.json,
    figures/ and the scenarios of the worst trials. Ctrl-C, kill -9 or a full disk lose nothing: --resume goes on.
    `undertow campaign status DIR` says how far it is.
    """
    from undertow.cli import campaign as command

    if str(campaign) == "status":
        told = {"--out": out, "--resume": resume, "--workers": workers, "--cluster": cluster, "--overwrite": overwrite}
        told["--allow-code"] = allow_code
        return command.status(folder or Path(), [name for name, value in told.items() if value])
    if folder is not None:
        command.refuse_second(folder)
    return command.campaign(campaign, out, resume, workers, cluster, overwrite, allow_code)


@app.command("list")
def list_parts(
    kind: Annotated[str | None, typer.Argument(metavar="[KIND]", help="One kind only, e.g. thrusters.")] = None,
) -> None:
    """List what there is.

    Kinds: vehicles, thrusters, power, plants, controllers, disturbances, references, sensors, sensors.
    """
    from undertow.cli.list_parts import list_parts

    list_parts(kind)


@app.command()
def describe(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="A part (see `undertow list`), ./file.py:function, a vehicle file, scenario, metrics or signals.",
        ),
    ],
) -> None:
    """Describe a part.

    Shows its options, its parameters with unit, symbol and source, and advice. `describe scenario` shows the keys of
    a scenario file, `describe metrics` what is measured.
    """
    from undertow.cli.describe import describe

    describe(name)


@app.command()
def check(
    thing: Annotated[
        str,
        typer.Argument(metavar="THING", help="A vehicle file, a scenario, a part by name, or ./file.py:function."),
    ],
    option: Annotated[
        list[str] | None,
        typer.Option("--option", metavar="KEY=VALUE", help="Option of the part, e.g. parameters=wu2018; repeatable."),
    ] = None,
    allow_code: AllowCode = False,
) -> int:
    """Check a vehicle, another part or a scenario.

    Says what is wrong (error) or odd (advice) with it, with the numbers that caused it, and what follows from its
    numbers. Exit code 2 when there are errors.
    """
    from undertow.cli.check import check

    return check(thing, option or [], allow_code)


@app.command()
def version() -> None:
    """Show versions."""
    from undertow.cli.version import version

    version()


def run(arguments: Sequence[str]) -> int:
    """Exit code of `undertow` with these arguments; what it says goes to stdout and stderr."""
    return run_guarded(typer.main.get_command(app), arguments)


def main() -> None:
    """Entry point of the `undertow` command."""
    if not os.environ.get("UNDERTOW_TRACEBACK"):
        warnings.simplefilter("ignore")
    remember_interrupts()
    prepare()
    code = run(sys.argv[1:])
    if threading.active_count() > 1:  # one may be in compiled code, or compiling; nothing can stop it gently
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


if __name__ == "__main__":
    main()
