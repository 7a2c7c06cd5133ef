"""`undertow init` writes scenarios that are valid as they are, in the catalogue's words, and never replaces a file."""

import json
import re
from pathlib import Path

import jsonschema
import pytest

from undertow.cli.init import _THRUSTERS
from undertow.cli.main import run
from undertow.core import catalogue
from undertow.core.contracts import Model
from undertow.scenario.build import build
from undertow.scenario.json_schema import scenario_schema
from undertow.scenario.reading import read

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
TEMPLATES = ROOT / "undertow" / "scenario" / "templates"
# Words before the list of names in a comment of the template -> kind of part.
LISTED = {
    "Vehicles": "vehicles",
    "Thrusters": "thrusters",
    "Controllers": "controllers",
    "References": "references",
    "Disturbances": "disturbances",
    "Navigation filters, which give a law its measurement": "navigation",
}


@pytest.fixture(scope="module")
def schema():
    return scenario_schema()


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def names(folder):
    return {path.name for path in folder.iterdir()}


def valid(schema, data) -> bool:
    return jsonschema.Draft7Validator(schema).is_valid(data)


@pytest.mark.parametrize("vehicle", _THRUSTERS)
def test_what_is_written_keeps_to_the_schema(vehicle, empty_folder, schema):
    assert run(["init", "--vehicle", vehicle]) == 0
    data = read(Path("scenario.yaml")).data
    assert data["plant"]["vehicle"] == vehicle and valid(schema, data)
    assert names(empty_folder) == {"scenario.yaml", "scenario.schema.json"}
    assert json.loads((empty_folder / "scenario.schema.json").read_text()) == schema


def test_own_parts_fit(empty_folder, capsys, schema):
    """Both at once, in a folder and under a name of their own."""
    assert run(["init", "my study/storm.yaml", "--own-vehicle", "--own-controller"]) == 0
    assert "cd 'my study' && undertow check storm.yaml && undertow simulate storm.yaml" in capsys.readouterr().out
    assert names(empty_folder / "my study") == {"storm.yaml", "scenario.schema.json", "my_rov.yaml", "my_controller.py"}
    data = read(Path("my study/storm.yaml")).data
    assert valid(schema, data) and data["plant"]["vehicle"] == "my_rov.yaml"
    assert data["controller"] == {"kind": "./my_controller.py:my_controller", "slope": 2}
    assert "#     undertow simulate storm.yaml" in (empty_folder / "my study" / "storm.yaml").read_text()


def test_own_parts_that_are_there(empty_folder, schema):
    """A vehicle and a controller that the user has, from any folder; neither is written again."""
    assert run(["init", "parts 1", "--own-vehicle", "--own-controller"]) == 0
    given = ["--vehicle", "parts 1/my_rov.yaml", "--controller", "parts 1/my_controller.py:my_controller"]
    assert run(["init", "study/both.yaml", *given]) == 0
    assert names(empty_folder / "study") == {"both.yaml", "scenario.schema.json"}
    data = read(Path("study/both.yaml")).data
    assert valid(schema, data) and data["plant"]["vehicle"] == "../parts 1/my_rov.yaml"
    assert data["controller"] == {"kind": "../parts 1/my_controller.py:my_controller"}
    assert isinstance(build(read(Path("study/both.yaml"))).closed_loop.controller.model, Model)


@pytest.mark.slow
@pytest.mark.parametrize(
    "options", [*(["--vehicle", name] for name in _THRUSTERS), ["--own-vehicle"], ["--own-controller"]], ids=" ".join
)
def test_it_is_simulated(options, capsys):
    """As it is written; shipped laws keep the vehicle within the bounds that the file states."""
    assert run(["init", *options]) == 0
    assert run(["check", "scenario.yaml"]) == 0
    assert "0 errors" in capsys.readouterr().out
    assert run(["simulate", "scenario.yaml", "--no-prediction"]) == 0
    verdict = "It " if "--own-controller" in options else "It went well from"
    assert verdict in capsys.readouterr().out


def test_comments_list_the_catalogue():
    """Every list of names in a comment is complete."""
    text = re.sub(r"\n +# +(?=\w+(?:,|$|\n))", " ", (TEMPLATES / "scenario.yaml").read_text())
    for words, kind in LISTED.items():
        (line,) = re.findall(rf"# {words}: (.*?)(?:, or .*)?$", text, re.MULTILINE)
        assert re.split(r",\s*", line) == sorted(catalogue.names(kind))


def test_no_second_version():
    """The files that `init` writes are those of the examples and of the page on own controllers."""
    assert (TEMPLATES / "my_rov.yaml").read_text() == (ROOT / "examples" / "my_rov.yaml").read_text()
    (page,) = (ROOT / "docs").rglob("your-own-controller.md")
    law = (TEMPLATES / "my_controller.py").read_text()
    assert f"```python\n{law}```" in page.read_text()
    tutorial = (ROOT / "docs" / "tutorials" / "3-your-controller.md").read_text()
    excerpts = re.findall(r"```python\n(.*?)```", tutorial, re.DOTALL)
    assert len(excerpts) == 3 and all(excerpt in law for excerpt in excerpts)


def test_nothing_is_replaced(empty_folder, capsys):
    (empty_folder / "my_rov.yaml").write_text("mine")
    assert run(["init", "--own-vehicle"]) == 2
    assert "`PATH` must be a place without these files, but is one that has my_rov.yaml" in capsys.readouterr().err
    assert names(empty_folder) == {"my_rov.yaml"} and (empty_folder / "my_rov.yaml").read_text() == "mine"


def test_a_second_scenario_stands_beside_the_first(empty_folder):
    assert run(["init"]) == 0 and run(["init", "other.yaml", "--vehicle", "odin"]) == 0
    assert run(["init"]) == 2
    assert names(empty_folder) == {"scenario.yaml", "other.yaml", "scenario.schema.json"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--vehicle", "remus100"], "`--vehicle` must be a vehicle of the catalogue with more than one thruster"),
        (["--vehicle", "bluerov2_heavi"], "Did you mean `bluerov2_heavy`?"),
        (["--vehicle", "odin", "--own-vehicle"], "`--vehicle` must be left out with --own-vehicle, but is odin"),
        (["--vehicle", "none.yaml"], "`--vehicle` must be a vehicle file that is there, but is none.yaml"),
        (["--controller", "rcaf"], "`--controller` must be FILE.py:FUNCTION, but is rcaf"),
        (["--controller", "none.py:law"], "`--controller`"),
        (["--controller", "a.py:law", "--own-controller"], "`--controller` must be left out with --own-controller"),
        (["a_file.txt"], "`PATH` must be a folder, or a file that ends in .yaml, but is a_file.txt, another file"),
        (["a_file.txt/scenario.yaml"], "`PATH` must be a folder"),
    ],
)
def test_mistakes(arguments, says, empty_folder, capsys):
    (empty_folder / "a_file.txt").write_text("")
    assert run(["init", *arguments]) == 2
    assert says in capsys.readouterr().err
    assert names(empty_folder) == {"a_file.txt"}


def test_nothing_is_left_when_the_disk_is_full(empty_folder, monkeypatch, capsys):
    opened = Path.open

    def full(self, *arguments, **options):
        if self.name == "my_controller.py":
            raise OSError(28, "No space left on device", str(self))
        return opened(self, *arguments, **options)

    monkeypatch.setattr(Path, "open", full)
    assert run(["init", "new/folder", "--own-controller"]) == 4
    assert "No space left on device" in capsys.readouterr().err
    assert names(empty_folder) == set()


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.yaml")), ids=lambda path: path.stem)
def test_examples_keep_to_the_schema(path, schema):
    data = read(path).data
    assert valid(schema, data) == ("plant" in data)  # a vehicle file is no scenario


@pytest.mark.parametrize(
    "change",
    [
        {"controler": "pid"},
        {"controller": "pidd"},
        {"plant": {"vehicle": "odin", "thruster": {"kind": "t2000"}}},
        {"loop": {"dt": -1.0}},
        {"loop": {"kind": "sometimes"}},
        {"disturbance": [{"velocity": [1, 0, 0]}]},
        {"reference": None},
        {"navigation": {"kind": "observer", "sensors": ["imu", "dvll"]}},
    ],
    ids=str,
)
def test_schema_refuses(change, schema):
    data = read(TEMPLATES / "scenario.yaml").data
    assert valid(schema, data) and not valid(schema, data | change)


def test_schema_completes(schema):
    """Every part is offered where it may stand, and every option of it with its meaning."""
    for kind in catalogue.KINDS:
        offered = {one["const"] for one in schema["$defs"][kind]["anyOf"] if "const" in one}
        assert offered == {*catalogue.names(kind), *catalogue.presets(kind)}
    options = {
        one["if"]["properties"]["kind"]["const"]: one["then"]["properties"]
        for one in schema["$defs"]["controllers"]["allOf"]
    }
    assert options["pid"]["integral_share"]["default"] == 0.1 and "model" not in options["pid"]
    assert options["rcaf"]["preset"] == {"enum": ["paper", "robust", "learning"]} and "bandwidth" in options["rcaf"]
    assert "bandwidth" in options["robust"] and "preset" not in options["robust"]


def test_schema_is_printed(capsys, schema):
    assert run(["describe", "scenario", "--json-schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema
    assert run(["describe", "pid", "--json-schema"]) == 2
