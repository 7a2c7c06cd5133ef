"""Stack and state of an exported controller, with and without a supervisor: python benchmarks/exported_stack.py

The controller of examples/bluerov2_heavy.yaml (preset `robust`) runs its test vectors on this machine, compiled by gcc,
in a thread whose stack is painted before. The stack is what the steps touched beyond an empty thread.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from undertow.outside.export.controller import export_controller
from undertow.scenario.build import build
from undertow.scenario.reading import from_data, read

HERE = Path(__file__).parent
SCENARIO = HERE.parent / "examples/bluerov2_heavy.yaml"
LEVELS = ("-Os", "-O2")


def measured(supervised: bool, precision: str) -> list[dict[str, Any]]:
    """Rows of one program, by level of optimisation."""
    data = read(SCENARIO).data | {"supervisor": supervised}
    exported = export_controller(build(from_data(data)), precision=precision)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        exported.write(Path(folder))
        for level in LEVELS:
            compiler = ("gcc", "-std=gnu11", level, "-ffp-contract=off", "-I.")
            definitions = ("-DNAME=controller", '-DVECTORS="controller_vectors.h"')
            sources = (HERE / "host_stack/measure.c", "controller.c")
            done(folder, *compiler, *definitions, *sources, "-o", "test", "-lm", "-pthread")
            done(folder, *compiler, "-c", "controller.c", "-o", "part.o")
            code = int(done(folder, "size", "part.o").splitlines()[1].split()[0])
            found = json.loads(done(folder, "./test"))
            rows.append({"supervisor": supervised, "precision": precision, "option": level, "code": code, **found})
    return rows


def done(folder: str, *command: Any) -> str:
    """What a command prints."""
    finished = subprocess.run([str(word) for word in command], cwd=folder, capture_output=True, text=True, timeout=600)
    if finished.returncode != 0:
        sys.exit(f"{command[0]} failed: {finished.stderr}{finished.stdout}")
    return finished.stdout


def main() -> None:
    print(f"{'supervisor':<12}{'precision':<11}{'option':<8}{'code':>8}{'state':>8}{'stack':>8}  steps that differ")
    for supervised in (False, True):
        for precision in ("float32", "float64"):
            for row in measured(supervised, precision):
                numbers = f"{row['code']:>8}{row['state']:>8}{row['stack']:>8}  {row['different']} of {row['steps']}"
                print(f"{row['supervisor']!s:<12}{row['precision']:<11}{row['option']:<8}{numbers}", flush=True)


if __name__ == "__main__":
    main()
