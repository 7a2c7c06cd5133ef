"""`undertow export`: controller, navigation filter and vehicle for other places than undertow."""

from collections.abc import Callable
from typing import Any

from undertow.cli.exit_codes import DONE
from undertow.cli.options.export import ExportCommand
from undertow.cli.stages import stage
from undertow.cli.tables import wide_console
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.outside.browser.browser_page import export_page
from undertow.outside.export.c_program import Exported
from undertow.outside.export.controller import export_controller
from undertow.outside.export.fmu import export_fmu
from undertow.outside.export.navigation import export_navigation
from undertow.outside.export.vehicle import export_vehicle
from undertow.scenario.build import Built, build
from undertow.scenario.reading import read
from undertow.studies.comparison.candidates import built_with_each, entries_of, label

_PARTS = ("controller", "navigation", "vehicle")


def export(command: ExportCommand) -> int:
    """Write a part of a scenario as C99, controller and vehicle as FMUs, or a page; return the exit code.

    Raises:
        BadInput: no folder is given, or something cannot be exported.
    """
    c99, fmu, part, name, output = command.c99, command.fmu, command.part, command.name, command.output
    formats = {"precision": command.precision, "attitude": command.attitude, "velocity": command.velocity}
    if c99 is None and fmu is None and command.wasm is None:
        hint = "Or --fmu for units of co-simulation, or --wasm for a page"
        raise BadInput("--c99", "be given: the folder for the files", hint=hint)
    checks.choice("--part", part, _PARTS)
    if command.wasm is None and command.controllers is not None:
        raise BadInput("--controllers", "stand beside --wasm", "without it")
    if c99 is None and (part != "controller" or name):
        raise BadInput("--name" if name else "--part", "stand beside --c99", "without it")
    if part != "controller" and output != "input":
        raise BadInput("--output", f"be left out with --part {part}", output)
    if part == "navigation" and (formats["attitude"], formats["velocity"]) != ("euler", "body"):
        must = "be left out with --part navigation, which gives quaternions and body velocities"
        raise BadInput("--attitude, --velocity", must, f"{formats['attitude']}, {formats['velocity']}")
    console = wide_console()
    say: Callable[[str], None] = lambda text: console.print(text, highlight=False, soft_wrap=True)
    with stage(console, "reading and building"):
        built = build(read(command.scenario, allow_code=command.allow_code))
    if c99 is not None:
        with stage(console, "C99 and its test"):
            exported = _in_c(built, part, name or part, output, formats)
        exported.write(c99, command.overwrite)
        say(f"{len(exported.files)} files, {_kilobytes(exported)}: {c99}")
        say(f"To compile and test them: make -C {c99} test")
    if fmu is not None:
        with stage(console, "FMUs and their library"):
            units = export_fmu(built, output=output, **formats)
        units.exported.write(fmu, command.overwrite, "--fmu")
        say(f"{' and '.join(units.exported.files)}, {_kilobytes(units.exported)}: {fmu}")
        if units.without_library:
            say(f"They hold their sources only, because {units.without_library}. Compile these where they are used.")
    if command.wasm is not None:
        with stage(console, "C99 and WebAssembly"):
            page = export_page(_built_by_law(built, command))
        page.write(command.wasm, command.overwrite, "--wasm")
        say(f"{_kilobytes(page)}: {command.wasm / 'index.html'}")
    return DONE


def _built_by_law(built: Built, command: ExportCommand) -> dict[str, Built]:
    """Name -> the scenario with it, for each controller of the page."""
    if command.controllers is None:
        return {label(built.resolved["controller"]): built}
    return built_with_each(entries_of(command.controllers), built.text, command.scenario)


def _in_c(built: Built, part: str, name: str, output: str, formats: dict[str, Any]) -> Exported:
    if part == "vehicle":
        return export_vehicle(built, name, **formats)
    if part == "navigation":
        return export_navigation(built, name, precision=formats["precision"])
    return export_controller(built, name, output=output, **formats)


def _kilobytes(exported: Exported) -> str:
    return f"{sum(map(len, exported.files.values())) / 1e3:.0f} kB"
