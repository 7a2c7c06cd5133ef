"""Options of `undertow identify`."""

import dataclasses
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from undertow.cli.options.command import Command
from undertow.cli.options.shared import AllowCode, Details, Overwrite, Pdf, Priors, Resume, results


@dataclasses.dataclass(frozen=True)
class IdentifyCommand(Command):
    """Identify the numbers of a vehicle from logs of its dives, and say how sure they are.

    The scenario names the vehicle and its thrusters, whose numbers are what is known beforehand. The command compares
    the motion in the logs with that of the model, driven by the logged inputs, and estimates added mass, damping,
    restoring and the thrusters. Every dive is also predicted from the others. It writes identification.html,
    identification.json and figures/.

    With --thruster, a thruster is identified from records of a test bench instead, without a scenario: tables whose
    header names command (pwm_us, duty or voltage_V), thrust (thrust_N, thrust_kgf) and, where they were measured,
    current, speed, supply and time. thruster.yaml is then the section for a scenario.
    """

    runs: ClassVar = "undertow.cli.identify:identify_vehicle"
    named: ClassVar = "identify"
    scenario: Annotated[
        Path | None, typer.Argument(metavar="SCENARIO", help="A .yaml file, or an earlier run.nc.", show_default=False)
    ] = None
    logs: Annotated[
        list[Path] | None, typer.Argument(metavar="LOG...", help="Logs of dives of one vehicle.", show_default=False)
    ] = None
    thruster: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="BENCH.csv",
            help="Identify a thruster from this bench record, settled or over time; may be repeated.",
        ),
    ] = None
    supply: Annotated[
        float | None,
        typer.Option(
            metavar="VOLTS",
            help="With --thruster: supply of pulses and duties, or which rows to use where the record has several.",
        ),
    ] = None
    compare: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="With --thruster: also judge this thruster of the catalogue, such as t200."),
    ] = None
    mapping: Annotated[
        Path | None,
        typer.Option(metavar="FILE.yaml", help="Which columns of the logs are which signal, in which unit and frame."),
    ] = None
    unseen: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="LOG", help="A further dive, which is only predicted, to judge the result; may be repeated."
        ),
    ] = None
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A parameter to estimate, a group (added_mass) or a pattern (*.yaw); may be repeated. Without it: "
            "added mass, damping, restoring, gain, reverse gain and lag of the thrusters.",
        ),
    ] = None
    prior: Priors = None
    per_axis: Annotated[
        bool,
        typer.Option(
            "--per-axis",
            help="The inputs push along surge, sway, heave, roll, pitch and yaw (sticks or wrenches) instead of "
            "driving the thrusters.",
        ),
    ] = False
    method: Annotated[
        str,
        typer.Option(
            metavar="WORD",
            help="output_error, or prediction_error for dives that unknown forces disturb (a tether, eddies): a Kalman "
            "filter follows the motion, and estimates what pushes the vehicle besides its thrusters.",
        ),
    ] = "output_error"
    profile: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Also find the interval of this free parameter, group or pattern by the profile of the likelihood, "
            "for numbers that the dives hardly determine; may be repeated.",
        ),
    ] = None
    step: Annotated[float, typer.Option(metavar="SECONDS", help="Step of the integration.")] = 0.05
    segment: Annotated[
        float, typer.Option(metavar="SECONDS", help="Length of the segments whose begin is estimated, too.")
    ] = 10.0
    out: Annotated[Path | None, results("runs/NAME-identified")] = None
    overwrite: Overwrite = False
    resume: Resume = False
    allow_code: AllowCode = False
    pdf: Pdf = None
    details: Details = False

    def target(self) -> str:
        """That of a thruster where a bench record is given."""
        return "undertow.cli.identify_thruster:identify_bench" if self.thruster else self.runs
