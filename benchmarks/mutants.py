"""Do the tests notice a wrong program? Mutants of what computes, sampled at random, and the tests that kill them.

A mutant is the project with one operator, number, comparison or condition of one file changed (operators of Cosmic Ray,
`pip install cosmic-ray`). Every site of a change in the rooms below is as likely as any other. Mutants are tested one
by one in a copy of the project; a mutant that no test notices has survived.

    python benchmarks/mutants.py --out mutants.csv                    # 100 mutants, the quick set
    python benchmarks/mutants.py --list                               # print them only
    python benchmarks/mutants.py --only 3,17 --tests "-m full -n auto"             # further tests for some of them
    python benchmarks/mutants.py --only 3,17 --tests "-m full -n auto" --together  # all in one copy, which saves time

Where many survivors stand together in one copy, a full set that passes has missed all of them.
"""

import argparse
import ast
import csv
import itertools
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from cosmic_ray.ast import ast_nodes, get_ast_from_path
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

ROOT = Path(__file__).parents[1]
# Core, physics, control and simulation.
ROOMS = (*("core", "physics", "control"), "simulation/loop")
# Operators that need arguments, and unions of types, which compute nothing.
LEFT_OUT = re.compile(r"Variable|RemoveDecorator|BitOr|ExceptionReplacer")
# What a test of the whole program prints for a test that failed.
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)
SECONDS = 1800
NONE_SELECTED = 5  # exit code of pytest


class Mutant(NamedTuple):
    """One change: the file, the operator, and which of its sites."""

    path: str
    line: int
    operator: str
    occurrence: int

    def code(self, source: str) -> str:
        """The changed source."""
        return mutate_code(source, get_operator(self.operator)(), self.occurrence)

    def change(self) -> str:
        """The line before and after."""
        before = (ROOT / self.path).read_text()
        after = self.code(before).splitlines()
        changed = [(old, new) for old, new in zip(before.splitlines(), after, strict=False) if old != new]
        return " -> ".join(line.strip() for line in changed[0]) if changed else "?"


def annotation_positions(source: str) -> set[tuple[int, int]]:
    """Positions (line, column) inside annotations, which compute nothing."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        for annotation in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            if annotation is not None:
                found |= {(part.lineno, part.col_offset) for part in ast.walk(annotation) if hasattr(part, "lineno")}
    return found


def sites_of(path: Path) -> dict[tuple[int, int], list[Mutant]]:
    """Every place of a file that can be changed, with the changes that are possible there."""
    tree, ignored = get_ast_from_path(path), annotation_positions(path.read_text())
    sites: dict[tuple[int, int], list[Mutant]] = {}
    for name in operator_names():
        if LEFT_OUT.search(name):
            continue
        operator = get_operator(name)()
        positions = (start for node in ast_nodes(tree) for start, _ in operator.mutation_positions(node))
        for occurrence, start in enumerate(positions):
            if start not in ignored:
                mutant = Mutant(str(path.relative_to(ROOT)), start[0], name, occurrence)
                sites.setdefault(start, []).append(mutant)
    return sites


def is_python(mutant: Mutant) -> bool:
    """Whether its code can be read: the star of an argument list is no product."""
    try:
        ast.parse(mutant.code((ROOT / mutant.path).read_text()))
    except SyntaxError:
        return False
    return True


def sample(count: int, seed: int) -> list[Mutant]:
    """Mutants, each at another site."""
    files = [file for room in ROOMS for file in sorted((ROOT / "undertow" / room).rglob("*.py"))]
    sites = [mutants for file in files for mutants in sites_of(file).values()]
    chance = random.Random(seed)
    chance.shuffle(sites)
    chosen = (chance.choice(mutants) for mutants in sites)
    return list(itertools.islice(filter(is_python, chosen), count))


class Copy:
    """A copy of all files but ignored ones, with caches of its own, in which mutants stand one after the other."""

    def __init__(self, folder: Path, tests: str):
        self.project, self.caches, self.tests = folder / "project", folder / "caches", tests
        command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
        names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
        for name in names:
            (self.project / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, self.project / name)

    def failures(self, mutants: list[Mutant]) -> list[str]:
        """Tests that fail with these changes; one sentence where the tests did not come to an end."""
        paths = {self.project / mutant.path for mutant in mutants}
        originals = {path: path.read_text() for path in paths}
        for mutant in mutants:
            path = self.project / mutant.path
            path.write_text(mutant.code(path.read_text()))
        try:
            # One test that fails is enough to kill one mutant; of several together all failures count.
            near = self._near(mutants[0]) if len(mutants) == 1 else []
            return (self._failures(near) if near else []) or self._failures([])
        finally:
            for path, original in originals.items():
                path.write_text(original)

    def _near(self, mutant: Mutant) -> list[str]:
        """Files of tests that import the changed module: they run first, as they are likely to fail."""
        module = mutant.path.removesuffix(".py").replace("/", ".")
        files = sorted((self.project / "tests").rglob("test_*.py"))
        return [str(file.relative_to(self.project)) for file in files if module in file.read_text()]

    def _failures(self, files: list[str]) -> list[str]:
        """Tests of some files that fail, or of all where none is named; files may have none that is selected."""
        environment = os.environ | {
            "UNDERTOW_CACHE": str(self.caches),
            "PYTHONPATH": f"{self.project}:{self.project}/simdjit",
        }
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *self.tests.split(), *files]
        try:
            ended = subprocess.run(
                command, cwd=self.project, env=environment, capture_output=True, text=True, timeout=SECONDS
            )
        except subprocess.TimeoutExpired:
            return [f"no end within {SECONDS} s"]
        failed = FAILED.findall(ended.stdout)
        passed = ended.returncode == 0 or (files and ended.returncode == NONE_SELECTED)
        return failed if failed or passed else [f"pytest ended with {ended.returncode}"]


def described(number: int, mutant: Mutant) -> list[str]:
    """Number, place and change."""
    return [str(number), f"{mutant.path}:{mutant.line}", mutant.change()]


def main() -> None:
    """Sample, test, and write a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=38)
    parser.add_argument("--tests", default="-x", help="arguments of pytest")
    parser.add_argument("--only", help="numbers of mutants, with commas")
    parser.add_argument("--together", action="store_true", help="all of them in one copy")
    parser.add_argument("--list", action="store_true", help="print them only")
    parser.add_argument("--out", type=Path, help="a table as CSV")
    options = parser.parse_args()
    mutants = sample(options.count, options.seed)
    numbers = [int(number) for number in options.only.split(",")] if options.only else list(range(len(mutants)))
    if options.list:
        for number in numbers:
            print(*described(number, mutants[number]), sep=" | ")
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder), options.tests)
        if options.together:
            print(*copy.failures([mutants[number] for number in numbers]), sep="\n")
            return
        if broken := copy.failures([]):
            sys.exit(f"Without a mutant these tests fail: {' '.join(broken)}")
        rows = []
        for number in numbers:
            killers = copy.failures([mutants[number]])
            verdict = "killed" if killers else "survived"
            rows.append([*described(number, mutants[number]), verdict, " ".join(killers[:1])])
            print(*rows[-1], sep=" | ", flush=True)
    if options.out:
        with options.out.open("w", newline="") as file:
            csv.writer(file).writerows([["number", "where", "change", "verdict", "first test that fails"], *rows])


if __name__ == "__main__":
    main()
