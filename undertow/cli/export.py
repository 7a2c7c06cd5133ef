"""`undertow export`: controller and vehicle for other places than undertow."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from undertow.cli.exit_codes import DONE
from undertow.cli.stages import stage
from undertow.cli.tables import wide_console
from undertow.core.errors import BadInput
from undertow.export.c_program import Exported
from undertow.export.controller import export_controller
from undertow.export.fmu import export_fmu
from undertow.export.vehicle import export_vehicle
from undertow.scenario.build import Built, build
from undertow.scenario.reading import read


def export(
    scenario: Path,
    c99: Path | None,
    fmu: Path | None,
    vehicle: bool,
    name: str | None,
    output: str,
    overwrite: bool,
    allow_code: bool,
    formats: dict[str, Any],
) -> int:
    """Write the controller or the vehicle of a scenario as C99, or both as FMUs, to folders; return the exit code.

    Args:
        scenario: file.
        c99, fmu: folders; None for none.
        vehicle: whether the C99 is that of the vehicle instead of the controller.
        name: begins the names in C; None for the usual one.
        output: what the vehicle takes, as for `Autopilot`.
        overwrite: whether to replace the files of an earlier export.
        allow_code: whether the Python code that a result file names may run.
        formats: precision, attitude and velocity, as for `export_controller`.

    Raises:
        BadInput: no folder is given, or something cannot be exported.
    """
    if c99 is None and fmu is None:
        raise BadInput("--c99", "be given: the folder for the files", hint="Or --fmu for units of co-simulation")
    if c99 is None and (vehicle or name):
        raise BadInput("--vehicle" if vehicle else "--name", "stand beside --c99", "without it")
    if vehicle and output != "input":
        raise BadInput("--output", "be left out with --vehicle, which takes its input", output)
    console = wide_console()
    say: Callable[[str], None] = lambda text: console.print(text, highlight=False, soft_wrap=True)
    with stage(console, "reading and building"):
        built = build(read(scenario, allow_code=allow_code))
    if c99 is not None:
        with stage(console, "C99 and its test"):
            exported = _in_c(built, vehicle, name, output, formats)
        exported.write(c99, overwrite)
        say(f"{len(exported.files)} files, {_kilobytes(exported)}: {c99}")
        say(f"To compile and test them: make -C {c99} test")
    if fmu is not None:
        with stage(console, "FMUs and their library"):
            units = export_fmu(built, output=output, **formats)
        units.exported.write(fmu, overwrite, "--fmu")
        say(f"{' and '.join(units.exported.files)}, {_kilobytes(units.exported)}: {fmu}")
        if units.without_library:
            say(f"They hold their sources only, because {units.without_library}. Compile these where they are used.")
    return DONE


def _in_c(built: Built, vehicle: bool, name: str | None, output: str, formats: dict[str, Any]) -> Exported:
    if vehicle:
        return export_vehicle(built, name or "vehicle", **formats)
    return export_controller(built, name or "controller", output=output, **formats)


def _kilobytes(exported: Exported) -> str:
    return f"{sum(map(len, exported.files.values())) / 1e3:.0f} kB"
