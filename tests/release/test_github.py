"""Files that GitHub reads: workflows call what `.ci/run` does on three systems, forms have the fields that they need."""

import re
import subprocess
from pathlib import Path

import pytest
from ruamel.yaml import YAML

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
FIELDS = {"input", "textarea", "dropdown", "checkboxes"}


def read(path):
    """A file of YAML 1.2, in which the key `on` is text."""
    return YAML(typ="safe").load(path.read_text(encoding="utf-8"))


def scripts(workflow):
    return [step["run"] for job in workflow["jobs"].values() for step in job["steps"] if "run" in step]


def test_every_submission_runs_the_same_command_as_a_contributor():
    workflow = read(ROOT / ".github" / "workflows" / "ci.yml")
    (job,) = workflow["jobs"].values()
    assert job["strategy"]["matrix"]["system"] == ["ubuntu-latest", "macos-latest", "windows-latest"]
    assert job["runs-on"] == "${{ matrix.system }}"
    assert scripts(workflow) == ["bash .ci/run"] and (ROOT / ".ci" / "run").is_file()
    assert "pull_request" in workflow["on"]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflow_may_do_little_and_ends(path):
    workflow = read(path)
    assert workflow["permissions"] == {"contents": "read"}
    for job in workflow["jobs"].values():
        assert job["timeout-minutes"] <= 120
        for step in job["steps"]:
            assert ("run" in step) != ("uses" in step)
            assert re.fullmatch(r"actions/[\w-]+@v\d+", step.get("uses", "actions/none@v1"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_scripts_are_bash_without_text_from_outside(path):
    """What a stranger may choose, such as the name of a branch, comes as a variable, never as a part of a script."""
    for script in scripts(read(path)):
        assert "${{" not in script
        checked = subprocess.run(["bash", "-n"], input=script, capture_output=True, text=True)
        assert checked.returncode == 0, checked.stderr


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.name)
def test_form(path):
    form = read(path)
    assert form["name"] and form["description"] and form["labels"]
    fields = [entry for entry in form["body"] if entry["type"] != "markdown"]
    assert {entry["type"] for entry in fields} <= FIELDS
    names = [entry["id"] for entry in fields]
    assert len(set(names)) == len(names)
    assert all(entry["attributes"]["label"] for entry in fields)
    assert any(entry.get("validations", {}).get("required") for entry in fields)


def test_there_is_a_form_for_each_kind_of_report():
    assert {path.stem for path in FORMS} == {"bug", "wrong_number", "feature"}
