"""Python code that a result file names does not run unless the user says so; that of a scenario file does."""

import getpass

import pytest
import xarray as xr
from good_scenario import SCENARIO, SMALL

from undertow.core import catalogue
from undertow.core.errors import BadInput
from undertow.run import simulate_scenario
from undertow.scenario.build import build
from undertow.scenario.foreign_code import changed
from undertow.scenario.provenance import checksum
from undertow.scenario.reading import parse, read
from undertow.scenario.results.netcdf import save
from undertow.scenario.results.repetition import compare
from undertow.scenario.results.run_scenario import run_scenario

pytestmark = pytest.mark.full

CODE = """
import pathlib

import undertow as ut

pathlib.Path(__file__).with_name("it ran").touch()


def my_goal(away: float = 1.0):
    return ut.references.setpoint([away])
"""
QUICK = SMALL.replace("{kind: setpoint, position: [1]}", "./my_goal.py:my_goal")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A result file that names code, and a campaign of it."""
    folder = tmp_path_factory.mktemp("his")
    (folder / "my_goal.py").write_text(CODE)
    save(run_scenario(parse(QUICK, "s.yaml", folder, "SCENARIO")).dataset, folder / "run.nc")
    (folder / "campaign.yaml").write_text("scenario: run.nc\ntrials: 2\n")
    return folder


@pytest.fixture
def his(folder):
    """The same, where the code has left no trace yet."""
    (folder / "my_goal.py").write_text(CODE)
    (folder / "it ran").unlink(missing_ok=True)
    catalogue._module.cache_clear()  # else the same contents would not run twice in this process
    return folder


@pytest.mark.parametrize("command", ["simulate", "analyze", "tune", "check", "campaign"])
def test_no_command_runs_it_unasked(his, refused, command):
    said = refused(command, str(his / ("campaign.yaml" if command == "campaign" else "run.nc")))
    assert "must not name Python code" in said and "--allow-code" in said
    user = getpass.getuser()
    assert f"run.nc, a file of {user}" in said
    assert f"`reference.kind` names {his / 'my_goal.py'}:my_goal, a file of {user}. " in said
    assert not (his / "it ran").exists()


def test_python_runs_it_when_asked_only(his):
    with pytest.raises(BadInput, match="allow_code=True"):
        simulate_scenario(his / "run.nc")
    assert not (his / "it ran").exists()
    repeated = simulate_scenario(his / "run.nc", allow_code=True)
    assert (his / "it ran").exists()
    assert compare(his / "run.nc", repeated.dataset).sentence == f"run.nc was repeated bit for bit {hash_of(his)}"


def test_a_command_runs_it_when_asked(his, undertow):
    assert undertow("check", str(his / "run.nc"), "--allow-code").code == 0
    assert (his / "it ran").exists()


def test_code_that_has_changed_since_is_named(his, refused):
    """In the question, and beside the verdict: the same numbers by other code, and other numbers by other code."""
    code, result = his / "my_goal.py", his / "run.nc"
    code.write_text(CODE + "# a remark\n")
    said = f"`reference.kind` names {code}:my_goal, a file of {getpass.getuser()}, changed since that run. "
    assert said in refused("simulate", str(result))
    same = compare(result, simulate_scenario(result, allow_code=True).dataset)
    assert same.equal and same.sentence.endswith(f"{hash_of(his)}, although {code} has changed")
    code.write_text(CODE.replace("setpoint([away])", "setpoint([away + 1.0])"))
    other = compare(result, simulate_scenario(result, allow_code=True).dataset)
    assert not other.equal and other.explained
    assert other.sentence.startswith(
        f"run.nc was not repeated bit for bit; other versions: {code} has changed. Differences: "
    )


def hash_of(folder):
    with xr.open_dataset(folder / "run.nc") as dataset:
        return f"(content hash {dataset.attrs['content_hash'][:12]})"


@pytest.mark.parametrize(
    ("key", "old", "new"),
    [
        ("plant.thruster.kind", "thruster: {kind: paper_table3", "thruster: {kind: ./x.py:f"),
        ("reference.kind", "kind: setpoint", "kind: ./x.py:f"),
        ("disturbance[0].kind", "disturbance: {kind: u1}", "disturbance: [{kind: ./x.py:f}]"),
        ("navigation", "seed: 3", "navigation: ./x.py:f"),
    ],
)
def test_it_is_found_wherever_it_stands(refused, tmp_path, key, old, new):
    """In a file that somebody else made, with a checksum that holds."""
    assert old in SCENARIO
    made = xr.Dataset(attrs={"scenario": SCENARIO.replace(old, new)})
    made.assign_attrs(checksum=checksum(made)).to_netcdf(tmp_path / "his.nc", engine="netcdf4")
    said = refused("simulate", "his.nc")
    assert f"`{key}` names ./x.py:f, a file that does not exist. " in said


def test_words_about_code_are_none(tmp_path):
    made = xr.Dataset(attrs={"scenario": f"{SCENARIO}description: 'after my_goal.py: my own vehicle'\n"})
    made.to_netcdf(tmp_path / "mine.nc", engine="netcdf4")
    assert read(tmp_path / "mine.nc").data["seed"] == 3


def test_the_hash_is_that_of_the_code_that_ran(his):
    """Code that is edited while it runs is recorded as it was read."""
    built = build(parse(QUICK, "s.yaml", his, "SCENARIO"))
    (his / "my_goal.py").write_text(CODE + "\n# later\n")
    run = run_scenario(built).dataset
    assert [path.name for path in changed(run.attrs["code"], built.resolved, his)] == ["my_goal.py"]
