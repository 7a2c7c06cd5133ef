"""The house, as house.md draws it: few rooms, one import direction, no circles, names that stand for one thing.

What nobody measures grows back. `pytest tests/conformance/test_architecture.py -s -k figures` prints the figures.
"""

import ast
import collections
import functools
import itertools
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAMS = ("undertow", "soak", "simdjit")
MOST_ROOMS = 12
MOST_FLOORS = 11
MOST_DUPLICATES = 12
SMALLEST_DUPLICATE = 3  # statements

# Where a module of ours is imported when it is used: the faces of packages, and the table of commands.
LAZY = ("__init__.py", "undertow/cli/options/command.py")


@functools.cache
def sources():
    """Syntax tree of each module of the project by its dotted name; its path is the attribute `path`."""
    modules = {}
    for folder in PROGRAMS:
        inner = ROOT / folder / folder if (ROOT / folder / folder).is_dir() else ROOT / folder
        for path in sorted(inner.rglob("*.py")):
            names = [folder, *path.relative_to(inner).with_suffix("").parts]
            name = ".".join(names[:-1] if names[-1] == "__init__" else names)
            modules[name] = ast.parse(path.read_text(encoding="utf-8"))
            modules[name].path = path.relative_to(ROOT).as_posix()
    return modules


def statements(node, in_function=False):
    """Every statement below a node, and whether it stands in a function; what only a type checker sees is left out."""
    for field in ("body", "orelse", "finalbody", "handlers"):
        for statement in getattr(node, field, ()):
            yield statement, in_function
            if not (isinstance(statement, ast.If) and "TYPE_CHECKING" in ast.dump(statement.test)):
                is_function = isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef)
                yield from statements(statement, in_function or is_function)


def imported(statement, modules):
    """Modules of the project that a statement imports."""
    if isinstance(statement, ast.Import):
        yield from (alias.name for alias in statement.names if alias.name in modules)
    if isinstance(statement, ast.ImportFrom) and statement.module:
        for alias in statement.names:
            full_name = f"{statement.module}.{alias.name}"
            if full_name in modules:
                yield full_name
            elif statement.module in modules:
                yield statement.module


@functools.cache
def imports():
    """Modules that each module imports, at its top or in a function."""
    modules = sources()
    targets = {}
    for name, tree in modules.items():
        targets[name] = {target for statement, _ in statements(tree) for target in imported(statement, modules)} - {
            name
        }
    return targets


def room_of(module):
    """The folder or file of the ground plan that a module belongs to."""
    first, *inner = module.split(".")
    return inner[0] if first == "undertow" and inner else first


def room_imports(module_imports):
    """Rooms that each room imports; `import undertow` and `__main__` stand above all and are left out."""
    below = collections.defaultdict(set)
    for module, targets in module_imports.items():
        if room_of(module) not in ("undertow", "__main__"):
            below[room_of(module)] |= {room_of(target) for target in targets} - {room_of(module), "undertow"}
    return below


def floors_of(below):
    """Floor of each room, from 1: above all that it imports."""

    @functools.cache
    def floor(room):
        return 1 + max((floor(lower) for lower in below.get(room, ())), default=0)

    return {room: floor(room) for room in below}


def in_circles(graph):
    """Modules that import each other in a loop, and those that import them: those that no order puts below the rest."""
    left = {name: set(targets) for name, targets in graph.items()}
    while free := [name for name, targets in left.items() if not targets & left.keys()]:
        for name in free:
            del left[name]
    return set(left)


def late_imports(modules):
    """Imports of modules of the project that stand in functions: path and line."""
    for tree in modules.values():
        if not tree.path.endswith(LAZY):
            for statement, in_function in statements(tree):
                if in_function and any(imported(statement, modules)):
                    yield f"{tree.path}:{statement.lineno}"


def classes_by_name(modules):
    """Paths by the name of a public class."""
    paths = collections.defaultdict(list)
    for tree in modules.values():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                paths[node.name].append(tree.path)
    return paths


def duplicates(modules):
    """Groups of functions, in several files, whose statements are the same."""
    groups = collections.defaultdict(list)
    for tree in modules.values():
        for function, _ in statements(tree):
            if isinstance(function, ast.FunctionDef):
                body = function.body[1:] if ast.get_docstring(function) else function.body
                if sum(1 for _ in statements(function)) >= SMALLEST_DUPLICATE:
                    text = ast.dump(function.args) + "".join(map(ast.dump, body))
                    groups[text].append(f"{tree.path}:{function.name}")
    return [group for group in groups.values() if len({place.split(":")[0] for place in group}) > 1]


def test_few_rooms_and_floors():
    rooms = {path.name for path in (ROOT / "undertow").iterdir() if (path / "__init__.py").exists()}
    assert len(rooms) <= MOST_ROOMS, sorted(rooms)
    floors = floors_of(room_imports(imports()))
    assert max(floors.values()) <= MOST_FLOORS, floors


def test_no_circles():
    assert in_circles(imports()) == set()


def test_imports_stand_at_the_top():
    assert list(late_imports(sources())) == []


def test_a_class_has_a_name_of_its_own():
    assert {name: paths for name, paths in classes_by_name(sources()).items() if len(paths) > 1} == {}


@pytest.mark.full
def test_few_duplicates():
    assert len(duplicates(sources())) <= MOST_DUPLICATES, duplicates(sources())


def test_no_module_has_the_name_of_one_of_python():
    names = {name: tree.path for name, tree in sources().items() if "." in name}
    assert [path for name, path in names.items() if name.rpartition(".")[2] in sys.stdlib_module_names] == []


def test_the_checks_see_what_they_are_for():
    """Negative controls."""
    late = ast.parse("def late():\n    from undertow.core import errors")
    late.path = "undertow/a.py"
    assert list(late_imports(sources() | {"undertow.a": late}))[-1] == "undertow/a.py:2"
    looped = imports() | {"undertow.core.errors": {"undertow.scenario.build"}}
    assert "undertow.core.errors" in in_circles(looped)
    higher = imports() | {"undertow.core.errors": {"undertow.core.checks"}, "undertow.extra.a": {"undertow.cli.main"}}
    assert floors_of(room_imports(higher))["extra"] == 1 + floors_of(room_imports(imports()))["cli"]
    twice = ast.parse("class Status:\n    pass\n")
    twice.path = "undertow/b.py"
    assert len(classes_by_name(sources() | {"undertow.b": twice})["Status"]) == 2
    same = [ast.parse("def f(x):\n    a = x\n    b = a\n    return b") for _ in range(2)]
    same[0].path, same[1].path = "undertow/c.py", "undertow/d.py"
    assert duplicates({"undertow.c": same[0], "undertow.d": same[1]}) == [["undertow/c.py:f", "undertow/d.py:f"]]


@pytest.mark.full
def test_figures(capsys):
    """What house.md asks for, in figures."""
    modules, floors = sources(), floors_of(room_imports(imports()))
    pairs = {(room, lower) for room, targets in room_imports(imports()).items() for lower in targets}
    lines = sum(len((ROOT / tree.path).read_text(encoding="utf-8").splitlines()) for tree in modules.values())
    with capsys.disabled():
        print()
        for floor, rooms in itertools.groupby(sorted(floors, key=floors.__getitem__), floors.__getitem__):
            print(f"floor {floor}: {', '.join(rooms)}")
        print(f"arrows between rooms {len(pairs)}; modules in circles {len(in_circles(imports()))}; lines {lines}")
        print(f"imports in functions {len(list(late_imports(modules)))}; duplicates {len(duplicates(modules))}")
        print(f"class names used twice {sum(len(paths) > 1 for paths in classes_by_name(modules).values())}")
    assert lines > 0
