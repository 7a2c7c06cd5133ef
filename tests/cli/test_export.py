"""`undertow export`: files that compile without a warning and meet their own test; errors that say what to do."""

import re
import shutil
import subprocess

import pytest
from good_scenario import SMALL

from undertow.cli.main import run

pytestmark = pytest.mark.full

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]


def made(folder, *arguments):
    return run(["export", "examples/paper_example2.yaml", "--c99", str(folder), *arguments])


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A folder that tests copy before they change it."""
    folder = tmp_path_factory.mktemp("exported") / "c"
    assert made(folder) == 0
    return folder


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_the_code_meets_its_test(tmp_path, precision, capsys):
    assert made(tmp_path / "c", "--precision", precision, "--name", "odin", "--attitude", "quaternion") == 0
    assert "6 files" in capsys.readouterr().out
    for compiler in COMPILERS:
        for flags in ("-O2", "-O1 -fsanitize=undefined,address -fno-sanitize-recover=all"):
            done = subprocess.run(
                ["make", "clean", "test", f"CC={compiler}", f"CFLAGS={flags}"],
                cwd=tmp_path / "c",
                capture_output=True,
                text=True,
            )
            assert done.returncode == 0, done.stderr
            assert "0 of 50 steps differ" in done.stdout


def test_no_heap_and_no_globals(exported):
    text = (exported / "controller.c").read_text()
    assert not re.search(r"\b(malloc|calloc|free|printf|static (?!const)\w+ \w+(\[|;| =))", text)
    called = set(re.findall(r"\b([a-z]+)f?\(", text)) - {"if", "sizeof", "switch", "for"}
    known = {"fma", "fmod", "copysign", "fabs", "sqrt", "floor", "ceil", "nearbyint", "memcpy", "isfinite"}
    known |= {"defined", "optimize"}
    assert called <= known | {"void"}


def test_a_changed_test_vector_is_noticed(exported, tmp_path):
    """The test can fail: one last bit of one output."""
    shutil.copytree(exported, tmp_path / "c")
    path = tmp_path / "c/controller_vectors.h"
    head, outputs = path.read_text().split("OUTPUTS[STEPS]")
    number = re.search(r"0x1\.[0-9a-f]{12}([0-9a-f])p", outputs)
    assert number is not None
    other = "1" if number[1] != "1" else "2"
    path.write_text(head + "OUTPUTS[STEPS]" + outputs[: number.start(1)] + other + outputs[number.end(1) :])
    done = subprocess.run(["make", "test", f"CC={COMPILERS[0]}"], cwd=tmp_path / "c", capture_output=True, text=True)
    assert done.returncode != 0 and "1 of 50 steps differ" in done.stdout


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--attitude", "both", "--velocity", "both"], "`attitude` must be one of"),
        (["--name", "My Controller"], "`name` must be lower-case letters, digits and underscores"),
        (["--name", "example"], "`name` must not be one of test, example, clean, which are in the Makefile"),
        (["--precision", "half"], "`precision` must be one of float64, float32"),
        (["--output", "pwm"], "`output` must be one of input, newtons, pulses, wrench"),
    ],
)
def test_what_is_wrong(tmp_path, capsys, arguments, said):
    assert made(tmp_path / "c", *arguments) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "c").exists()


def test_an_earlier_export_is_kept(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(SMALL)
    export = ["export", "s.yaml", "--c99", "c"]
    assert run(export) == 0
    before = (tmp_path / "c/controller.c").read_text()
    (tmp_path / "s.yaml").write_text(SMALL.replace("frequency: 2", "frequency: 3"))
    assert run(export) == 2
    assert "Use --overwrite" in capsys.readouterr().err
    assert (tmp_path / "c/controller.c").read_text() == before
    assert run([*export, "--overwrite"]) == 0
    assert (tmp_path / "c/controller.c").read_text() != before


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--fmu", "out", "--part", "vehicle"], "`--part` must stand beside --c99, but is without it"),
        (["--c99", "out", "--part", "hull"], "`--part` must be one of controller, navigation, vehicle"),
        (["--c99", "out", "--part", "navigation"], "`navigation` must be one of sensors: `kalman` or `observer`"),
        (["--c99", "out", "--part", "navigation", "--velocity", "world"], "`--attitude, --velocity` must be left out"),
        (["--fmu", "out", "--name", "odin"], "`--name` must stand beside --c99, but is without it"),
        (
            ["--c99", "out", "--part", "vehicle", "--output", "wrench"],
            "`--output` must be left out with --part vehicle",
        ),
    ],
)
def test_options_that_do_not_go_together(capsys, arguments, said):
    assert run(["export", "examples/paper_example2.yaml", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_without_a_folder(capsys):
    assert run(["export", "examples/paper_example2.yaml"]) == 2
    assert "`--c99` must be given: the folder for the files" in capsys.readouterr().err
