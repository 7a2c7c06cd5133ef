"""Controller and vehicle of a scenario as units of co-simulation, FMI 2.0, with the C of an export inside.

A unit is an archive of modelDescription.xml, the sources, and the library that this machine's compiler makes of them.
"""

import io
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp

from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.autopilot.functions import Functions
from undertow.outside.autopilot.measured_motion import Format
from undertow.outside.export.c_program import Exported
from undertow.outside.export.controller import checked, controller_program, functions_of
from undertow.outside.export.fmu_sources import sources_of
from undertow.outside.export.model_description import ModelDescription, model_description
from undertow.outside.export.variables import Names, Variable, group, signals
from undertow.outside.export.vehicle import numbers_of, vehicle_program
from undertow.physics.power.esc import ESC
from undertow.scenario.build import Built

_FLAGS = ("-O2", "-std=c99", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-shared")


class Units(NamedTuple):
    """Two units of co-simulation, by the names of their files, and why they have no library; "" where they have."""

    exported: Exported
    without_library: str


def export_fmu(
    built: Built,
    *,
    precision: str | None = None,
    attitude: str = "euler",
    velocity: str = "body",
    output: str = "input",
    esc: ESC | None = None,
) -> Units:
    """controller.fmu and vehicle.fmu of a scenario.

    Args:
        built: the scenario; its seed realizes what is random of the disturbance.
        precision: float64 or float32; None for that of the scenario.
        attitude, velocity: formats of motions, as for `Autopilot`.
        output: what the controller gives beside its command, as for `Autopilot`.
        esc: speed controllers for `pulses`; None for usual ones.

    Raises:
        BadInput: a format is unknown, or a part needs something that has no counterpart in C99.
    """
    form = Format(attitude, velocity)
    checked_precision = checked(precision or built.scenario.precision, form)
    with runtime.on_processor(), runtime.in_precision(checked_precision):
        functions = functions_of(built, form, output, esc)
        programs = {
            "controller": (controller_program(built, "controller", functions), _of_controller(built, functions)),
            "vehicle": (vehicle_program(built, "vehicle", form), _of_vehicle(built, functions)),
        }
    files, without = {}, ""
    for name, (program, variables) in programs.items():
        sources, unit = sources_of(program, variables, built.scenario.loop.duration)
        library, without = compiled(sources, name)
        files[f"{name}.fmu"] = _archive(sources, unit, library)
    return Units(Exported(files), without)


def _of_controller(built: Built, functions: Functions) -> list[Variable]:
    plant, motion = built.closed_loop.plant, functions.given.motion
    names = Names(plant, functions.form)
    goal = functions.given.target.position
    meaning = "whether the target is that of the scenario's reference, which begins at the start of the simulation"
    variables = [
        Variable("scenario_reference", ("model", "scenario_reference", 0), "tunable", "Boolean", "", meaning, True),
        *names.motion("input", "measured", motion, "measured"),
        *names.reports("input", "measured", functions.given.actuator, "measured"),
        *names.outputs("target.position", "target_position", "input", goal, "target"),
        *names.outputs("target.velocity", "target_velocity", "input", goal, "rate of the target", 1),
        *names.outputs("target.acceleration", "target_acceleration", "input", goal, "acceleration of the target", 2),
        *names.actuators("applied", "input", "applied", "input", "input applied since the last step to"),
        *names.actuators("command", "output", "command", "output", "input commanded of"),
    ]
    if functions.output.kind == "wrench":
        variables += names.wrench("output", "output", "output", "output", "force and moment of all thrusters")
    elif functions.output.kind != "input":
        entries = [f"thruster_{i + 1}" for i in range(plant.inputs())]
        variables += group("output", "output", "output", "output", entries, functions.output.unit, "output", ())
    return variables


def _of_vehicle(built: Built, functions: Functions) -> list[Variable]:
    plant, start = built.closed_loop.plant, built.scenario.initial
    names = Names(plant, functions.form)
    zero = [0.0] * len(plant.outputs)
    report = plant.output(jnp.zeros(()), plant.initial_state()).actuator
    status = "0 while the motion is valid: " + ", ".join(f"{int(code)} {code.word}" for code in Status if code)
    position, speed = start.position or zero, start.velocity or zero
    return [
        *names.outputs("initial.position", "initial_position", "parameter", position, "position at the start"),
        *names.outputs("initial.velocity", "initial_velocity", "parameter", speed, "rate at the start", 1),
        *names.actuators("command", "input", "command", "input", "commanded input of"),
        *names.wrench("external_wrench", "input", "external_wrench", "input", "load from outside, body axes"),
        *names.motion("output", "output", (None, None, None), "true"),
        *names.reports("output", "output", report, "true"),
        *names.actuators("applied", "output", "applied", "output", "input applied over the last step to"),
        Variable("status", ("output", "status", 0), "output", "Integer", "", status),
        *signals("output", "signals", numbers_of(plant)),
    ]


def compiled(sources: Mapping[str, str], name: str) -> tuple[bytes | None, str]:
    """The shared library of some sources, and why there is none; "" where there is one."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        return None, f"no library is made on {sys.platform}, {platform.machine()}"
    compiler = os.environ.get("CC", "")
    command = shlex.split(compiler) or [next(filter(shutil.which, ("cc", "gcc", "clang")), "cc")]
    if shutil.which(command[0]) is None:
        return None, f"there is no C compiler on this machine ({compiler or 'cc, gcc or clang'})"
    with tempfile.TemporaryDirectory() as folder:
        for file, text in sources.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        files = [file for file in sources if file.endswith(".c")]
        command += [*_FLAGS, *files, "-o", f"{name}.so", "-lm"]
        process = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if process.returncode != 0:
            raise BadInput("CC", "", f"the C compiler {command[0]} failed on the unit {name}: {process.stderr}")
        return (Path(folder) / f"{name}.so").read_bytes(), ""


def _archive(sources: Mapping[str, str], unit: ModelDescription, library: bytes | None) -> bytes:
    """The archive; the same parts give the same bytes."""
    contents: dict[str, bytes] = {
        "modelDescription.xml": model_description(unit, f"undertow {version('undertow')}").encode()
    }
    contents |= {f"sources/{name}": text.encode() for name, text in sources.items()}
    if library is not None:
        contents[f"binaries/linux64/{unit.identifier}.so"] = library
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()
