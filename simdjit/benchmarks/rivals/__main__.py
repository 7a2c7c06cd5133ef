"""simdjit beside other tools on this machine: python benchmarks/rivals [--json]

Two problems in 256 runs: a free pendulum, whose error is known, and one under a law that is sampled at 100 Hz with a
limited torque (`pendulum.py`); and the quadrotor of crazyflow. Of every tool the cheapest setting counts that reaches
the error asked for. Times are processor time on one core. The tools that are not installed are left out:

    pip install . heyoka diffrax numba CyRK mujoco crazyflow numbalsoda     # the last one needs a Fortran compiler
"""

import argparse
import itertools
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from ranking import table

TOOLS = ("simdjit", "xla", "heyoka", "numba", "cyrk", "numbalsoda", "mujoco", "crazyflow")


def measured(tool: str) -> list[dict[str, Any]]:
    """Rows of a tool, measured in a process of its own."""
    print(f"{tool} ...", file=sys.stderr)
    command = [sys.executable, "-W", "ignore", str(Path(__file__).with_name(f"by_{tool}.py"))]
    ran = subprocess.run(command, capture_output=True, text=True)
    if ran.returncode:
        print(f"{tool} is left out: {ran.stderr.strip().splitlines()[-1]}", file=sys.stderr)
    return [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print the rows as JSON")
    as_json = parser.parse_args().json
    rows = list(itertools.chain.from_iterable(map(measured, TOOLS)))
    if as_json:
        print(json.dumps({"rows": rows}, indent=1))
        return
    for cells in table(rows):
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
