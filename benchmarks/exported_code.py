"""What exported controllers, filters and vehicles take: python benchmarks/exported_code.py [--json]

The controller and a Kalman filter of the Heavy, and the controller of the paper's Example 2, run their test vectors on
a Cortex-M4 that QEMU emulates (machine mps2-an386). QEMU counts executed instructions; it knows no cycles, no waits for
memory and no pipeline.
Debian: gcc-arm-none-eabi, libnewlib-arm-none-eabi, qemu-system-arm.

The FMUs of the Heavy and of ODIN with full motors are validated by FMPy, and a step of each is timed on this machine.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from undertow.outside.export.c_program import Exported
from undertow.outside.export.controller import export_controller
from undertow.outside.export.fmu import export_fmu
from undertow.outside.export.navigation import export_navigation
from undertow.scenario.build import build
from undertow.scenario.reading import from_data, read

HERE = Path(__file__).parent
EXAMPLES = HERE.parent / "examples"
# Scenario and part; the filter is `kalman` with the scenario's sensors.
PROGRAMS = (("bluerov2_heavy", "controller"), ("bluerov2_heavy", "navigation"), ("paper_example2", "controller"))
TOOLS = ("arm-none-eabi-gcc", "arm-none-eabi-size", "qemu-system-arm")
PROCESSOR = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
MACHINE = ("-machine", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "none", "-icount", "shift=6")
COUNTS = 1.6  # of the timer per instruction: 64 ns at 25 MHz

ODIN = {
    "description": "ODIN, electromechanical thrusters, suite U1",
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "electromechanical"}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 3, 4, 0, 0, 1]},
    "disturbance": "u1",
    "loop": {"dt": 0.001},
}


def missing() -> list[str]:
    """Programs for the Cortex-M4 that this machine lacks."""
    return [tool for tool in TOOLS if shutil.which(tool) is None]


def exported_part(scenario: str, part: str, precision: str) -> Exported:
    """A part of an example in C."""
    text = read(EXAMPLES / f"{scenario}.yaml")
    if part == "controller":
        return export_controller(build(text), precision=precision)
    filtered = text.data | {"navigation": text.data["navigation"] | {"kind": "kalman"}}
    return export_navigation(build(from_data(filtered)), precision=precision)


def on_cortex_m4(scenario: str, part: str, precision: str, level: str) -> dict[str, Any]:
    """A part of an example, compiled at a level of optimisation: size, memory, instructions."""
    exported = exported_part(scenario, part, precision)
    with tempfile.TemporaryDirectory() as folder:
        exported.write(Path(folder))
        definitions = (f"-DNAME={part}", f'-DVECTORS="{part}_vectors.h"', "-I.")
        compile_one = (TOOLS[0], *PROCESSOR, "-std=c99", level, "-ffp-contract=off")
        link = ("-nostartfiles", "-specs=rdimon.specs", "-T", HERE / "cortex_m4/memory.ld", "-lm", "-o", "test.elf")

        def done(*command: Any) -> str:
            finished = subprocess.run(map(str, command), cwd=folder, capture_output=True, text=True, timeout=600)
            if finished.returncode != 0:
                sys.exit(f"{command[0]} failed: {finished.stderr}{finished.stdout}")
            return finished.stdout

        done(*compile_one, "-Wall", "-Wextra", "-Werror", "-pedantic", "-c", f"{part}.c", "-o", "part.o")
        done(*compile_one, *definitions, HERE / "cortex_m4/measure.c", "part.o", *link)
        code = int(done(TOOLS[1], "part.o").splitlines()[1].split()[0])
        semihosting = ("-semihosting-config", "enable=on,target=native", "-kernel", "test.elf")
        found = json.loads(done(TOOLS[2], *MACHINE, *semihosting))
    if abs(found.pop("counts_of_2000") - 2000 * COUNTS) > 8:
        sys.exit("QEMU's timer does not count instructions as expected.")
    mean, most = (round(found.pop(f"counts_{which}") / COUNTS) for which in ("mean", "most"))
    return {
        "scenario": scenario,
        "part": part,
        "precision": precision,
        "optimisation": level,
        "code_bytes": code,
        "state_bytes": found["state"],
        "stack_bytes": found["stack"],
        "instructions_mean": mean,
        "instructions_most": most,
        "steps_that_differ": found["different"],
        "steps": found["steps"],
    }


def of_fmus(name: str, source: Any, steps: int) -> list[dict[str, Any]]:
    """FMPy's findings on the FMUs of a scenario, and the median time of a step of each in their closed loop."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave
    from fmpy.validation import validate_fmu

    with tempfile.TemporaryDirectory() as folder:
        export_fmu(build(source), attitude="quaternion").exported.write(Path(folder))
        rows, slaves, variables = [], {}, {}
        for unit in ("controller", "vehicle"):
            path = f"{folder}/{unit}.fmu"
            rows.append({"scenario": name, "unit": unit, "findings": len(validate_fmu(path))})
            description = fmpy.read_model_description(path)
            extracted = fmpy.extract(path, f"{folder}/{unit}")
            slave = FMU2Slave(guid=description.guid, unzipDirectory=extracted, modelIdentifier=unit, instanceName=unit)
            slave.instantiate()
            slave.setupExperiment()
            slave.enterInitializationMode()
            slave.exitInitializationMode()
            slaves[unit] = slave
            variables[unit] = {one.name: one.valueReference for one in description.modelVariables if one.type == "Real"}
            period = float(description.defaultExperiment.stepSize)
        connected = {
            "controller": ("vehicle", [n for n in variables["controller"] if n in variables["vehicle"]][:-8]),
            "vehicle": ("controller", [n for n in variables["vehicle"] if n.startswith("command")]),
        }
        taken = {unit: [] for unit in slaves}
        for k in range(steps):
            for unit, (other, names) in connected.items():
                given = slaves[other].getReal([variables[other][one] for one in names])
                slaves[unit].setReal([variables[unit][one] for one in names], given)
                begun = time.perf_counter()
                slaves[unit].doStep(k * period, period)
                taken[unit].append(time.perf_counter() - begun)
        for slave in slaves.values():
            slave.freeInstance()
    return [row | {"us_per_step": round(1e6 * statistics.median(taken[row["unit"]]), 1)} for row in rows]


def table(rows: list[dict[str, Any]]) -> str:
    """Rows as a table in Markdown."""
    lines = [[key.replace("_", " ") for key in rows[0]], ["---"] * len(rows[0])]
    lines += [[str(value) for value in row.values()] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    as_json = parser.parse_args().json
    if lacking := missing():
        sys.exit(f"{', '.join(lacking)} not found. Debian: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi "
                 "qemu-system-arm")  # fmt: skip
    programs = [
        on_cortex_m4(*program, precision, level)
        for program in PROGRAMS
        for precision in ("float32", "float64")
        for level in ("-Os", "-O2")
    ]
    heavy, odin = read(EXAMPLES / "bluerov2_heavy.yaml"), from_data(ODIN)
    units = [*of_fmus("bluerov2_heavy", heavy, 5000), *of_fmus("odin, full motors", odin, 5000)]
    if as_json:
        print(json.dumps({"cortex_m4": programs, "fmu": units}, indent=2))
    else:
        print(table(programs), table(units), sep="\n\n")


if __name__ == "__main__":
    main()
