"""`undertow export`: a controller for other places than undertow."""

from pathlib import Path

from undertow.export.controller import export_controller
from undertow.cli.exit_codes import DONE
from undertow.cli.stages import stage
from undertow.cli.tables import wide_console
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.reading import read


def export(
    scenario: Path,
    folder: Path | None,
    name: str,
    precision: str | None,
    attitude: str,
    velocity: str,
    output: str,
    overwrite: bool,
    allow_code: bool,
) -> int:
    """Write the controller of a scenario as C99 to a folder; return the exit code."""
    if folder is None:
        raise BadInput("--c99", "be given: the folder for the files")
    console = wide_console()
    with stage(console, "reading and building"):
        built = build(read(scenario, allow_code=allow_code))
    with stage(console, "C99 and its test"):
        exported = export_controller(built, name, precision=precision, attitude=attitude, velocity=velocity, output=output)
    exported.write(folder, overwrite)
    size = sum(map(len, exported.files.values())) / 1e3
    console.print(f"{len(exported.files)} files, {size:.0f} kB: {folder}", highlight=False, soft_wrap=True)
    console.print(f"To compile and test them: make -C {folder} test", highlight=False, soft_wrap=True)
    return DONE
