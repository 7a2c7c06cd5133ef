"""benchmarks/yardstick.py: hand-written C++ of workload W1 computes what undertow computes, or the script fails."""

import importlib.util
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.studies.speed import workload

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
NO_COMPILER = (
    "There is no C++ compiler `{}`. Install g++ or clang++, or name another one in the environment variable CXX"
)


def loaded():
    spec = importlib.util.spec_from_file_location("yardstick", ROOT / "benchmarks" / "yardstick.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script


yardstick = loaded()


@pytest.fixture(autouse=True)
def usual_compiler(monkeypatch):
    monkeypatch.delenv("CXX", raising=False)


@pytest.fixture(scope="module")
def numbers():
    return yardstick.constants()


def program(folder, numbers):
    """The compiled program; None on a machine without a compiler, where the script says so."""
    try:
        return yardstick.compiled(folder, numbers)
    except BadInput as lacking:
        assert shutil.which("c++") is None and str(lacking) == NO_COMPILER.format("c++")
        return None


def test_it_computes_what_undertow_computes(tmp_path, numbers):
    """Every step of 200 ms, and every metric of 20 s; 0.00457549 is what `undertow bench --json` prints."""
    if (made := program(tmp_path, numbers)) is None:
        return
    one = workload.workload(workload.W1)
    found = yardstick.compare(made, one)
    assert found["trajectory_difference"] < 1e-9 and found["metrics_difference"] < 1e-9
    assert found["tracking_rms"] == pytest.approx(0.00457549, abs=5e-9)
    left_out = {"saturated_fraction", "bad_readings"}  # both are zero: no limit, and perfect navigation
    theirs, ours = yardstick.timed_metrics(made, one.steps, 1)[0], yardstick.metrics_of_undertow(one)
    more = {"orientation_rms"}  # undertow computes this besides
    assert theirs.keys() == ours.keys() - left_out - more and not any(ours[name] for name in left_out)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "factor", "said"),
    [("COMPOSITE", 1 + 1e-6, "undertow's trajectory to 1e-09"), ("SETTLED", 1.5, "undertow's metrics to 1e-09")],
)
def test_another_number_is_noticed(tmp_path, numbers, name, factor, said):
    """The comparison can fail: a gain changes the trajectory, the band of settling one metric only."""
    if (made := program(tmp_path, numbers | {name: factor * numbers[name]})) is None:
        return
    with pytest.raises(BadInput, match=said):
        yardstick.compare(made, workload.workload(workload.W1))


def test_numbers_are_written_with_every_bit(numbers):
    text = yardstick.header(numbers)
    for name, value in numbers.items():
        written = text.partition(f" {name} = ")[2].partition(";")[0].replace("{", " ").replace("}", " ").split(",")
        np.testing.assert_array_equal([float.fromhex(one) for one in written], np.ravel(value), err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments", [(), ("metrics",), ("metrics", "0", "1"), ("metrics", "10"), ("trajectory", "-1")]
)
def test_wrong_arguments(tmp_path, numbers, arguments):
    if (made := program(tmp_path, numbers)) is None:
        return
    with pytest.raises(BadInput, match=r"exit code 2: Usage: w1 trajectory STEPS"):
        yardstick.printed(made, *arguments)


def test_a_program_that_does_not_compile(tmp_path, numbers):
    if program(tmp_path, numbers) is None:
        return
    with pytest.raises(BadInput, match=r"does not compile w1\.cpp without a warning: .*POLE"):
        yardstick.compiled(tmp_path, {name: value for name, value in numbers.items() if name != "POLE"})


def test_a_run_that_fails(tmp_path, numbers):
    """A robust term of the wrong sign destabilises: the program stops and says when."""
    if (made := program(tmp_path, numbers | {"ROBUST_GAIN": -1e4})) is None:
        return
    with pytest.raises(BadInput, match=r"exit code 1: The run failed at \d"):
        yardstick.printed(made, "metrics", 20_000, 1)


@pytest.mark.parametrize(
    ("arguments", "compiler", "said"),
    [
        ((), "no-such-compiler", NO_COMPILER.format("no-such-compiler")),
        (("--rounds", "0"), "c++", "`--rounds` must be 1"),
    ],
)
def test_what_the_script_says(monkeypatch, capsys, arguments, compiler, said):
    monkeypatch.setenv("CXX", compiler)
    monkeypatch.setattr(sys, "argv", ["yardstick.py", *arguments])
    assert yardstick.main() == 2
    assert said in capsys.readouterr().err


@pytest.mark.slow
def test_figures(monkeypatch, capsys):
    """Ratios are those of the printed times, and all times are in the range of what processors do."""
    monkeypatch.setattr(yardstick, "REPETITIONS", 1)
    monkeypatch.setattr(sys, "argv", ["yardstick.py", "--rounds", "1", "--json"])
    if shutil.which("c++") is None:
        assert yardstick.main() == 2
        return
    assert yardstick.main() == 0
    found = json.loads(capsys.readouterr().out)
    assert found["flags"] == "-std=c++17 -O3 -march=native"
    for name in ("single", "batch", "batch_undisturbed"):
        ratio = found["yardstick_ns"] / found[f"{name}_ns"]
        assert found[f"{name}_times_yardstick"] == pytest.approx(ratio, rel=1e-12)
    assert 10 < found["batch_one_thread_ns"] < found["single_ns"] and 10 < found["yardstick_ns"] < 1e5
    monkeypatch.setattr(sys, "argv", ["yardstick.py", "--rounds", "1"])
    assert yardstick.main() == 0
    said = capsys.readouterr().out
    assert "-O3 -march=native" in said and "hand-written C++, one core" in said
