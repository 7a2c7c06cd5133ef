"""simdjit beside other tools on this machine: python benchmarks/rivals [--rounds 3] [--json]

Two problems in 256 runs: a free pendulum, whose error is known, and one under a law that is sampled at 100 Hz with a
limited torque (`pendulum.py`); and the quadrotor of crazyflow. Of every tool the cheapest setting counts that reaches
the error asked for. Times are processor time on one core, the shortest of all rounds: code that fills the vector units
takes half as long again while a neighbour on the same core uses them, too. Tools that are not installed are left out:

    pip install ".[rivals]"     # numbalsoda needs a Fortran compiler, or is left out of the list in pyproject.toml
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterable
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


def quickest(rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of all rounds the shortest time of each tool for each problem."""
    best: dict[tuple[str, str], dict[str, Any]] = {}
    for row in rows:
        key = row["problem"], row["tool"]
        if key not in best or (row["ns"] is not None and row["ns"] < best[key]["ns"]):
            best[key] = row
    return list(best.values())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print the rows as JSON")
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args()
    rows = quickest(row for _ in range(asked.rounds) for tool in TOOLS for row in measured(tool))
    if asked.json:
        print(json.dumps({"rows": rows}, indent=1))
        return
    for cells in table(rows):
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
