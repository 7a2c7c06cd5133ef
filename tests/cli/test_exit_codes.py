"""0 done, 1 a run failed, 2 bad input, 3 internal error, 4 files, 130 interrupted; one line each, no traceback."""

import os
import re
import subprocess
import sys
import time

import pytest
from good_scenario import SCENARIO, SMALL

from undertow.cli import simulate
from undertow.scenario.results import netcdf


def write(tmp_path, text=SCENARIO):
    (tmp_path / "s.yaml").write_text(text)


HOURS = SMALL.replace("duration: 0.1", "duration: 1e6").replace("record: 1e-2", "record: 100")


def raising(error):
    def fail(*arguments, **options):
        raise error

    return fail


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("simulat",), "No such command 'simulat'"),
        (("simulate",), "Missing argument 'SCENARIO'. See `undertow simulate --help`"),
        (("simulate", "s.yaml", "--ou", "o"), "No such option: --ou"),
        (("simulate", "s.yaml", "more"), "Got unexpected extra argument(s) (more). See `undertow simulate --help`"),
        (("simulate", "s.yaml", "--out"), "Option '--out' requires an argument. See `undertow --help`"),
        (("list", "thruster"), "`KIND` must be a kind of part, but is thruster. Did you mean `thrusters`?"),
        (("describe", "odn"), "`NAME` must be a part, but is odn. Did you mean `odin`?"),
        (("describe", "./none.py:none"), "`NAME` must name an existing file, but is ./none.py"),
    ],
)
def test_mistyped_command(refused, arguments, said):
    assert refused(*arguments).startswith(said)


def test_no_command_shows_the_help(undertow):
    said = undertow()
    assert said.code == 0 and "simulate" in said.out


@pytest.mark.full
def test_run_that_fails_is_1_and_keeps_its_results(undertow, tmp_path):
    text = SMALL.replace("limit: 20", "limit: 1e30").replace("frequency: 2", "frequency: 1e4")
    text = text.replace("duration: 0.1", "duration: 1")
    write(tmp_path, text)
    said = undertow("simulate", "s.yaml", "--out", "out")
    errors = [line for line in said.err.splitlines() if not line.startswith("Advice: ")]
    assert said.code == 1
    assert len(errors) == 1 and errors[0].startswith("Error: the run ended as `")
    assert " s of 1 s. " in errors[0]
    assert (tmp_path / "out" / "run.nc").is_file()


@pytest.mark.full
def test_internal_error_is_3(undertow, tmp_path, monkeypatch):
    monkeypatch.setattr(simulate, "run_scenario", raising(RuntimeError("broken\nin two lines")))
    write(tmp_path)
    said = undertow("simulate", "s.yaml", "--out", "out")
    line = (
        "Error: internal error, RuntimeError: broken in two lines. "
        "To see the traceback, run `undertow --traceback ...` or set UNDERTOW_TRACEBACK=1"
    )
    assert said.code == 3
    assert said.err.splitlines()[-1] == line
    assert "Traceback" not in said.err
    assert [path.name for path in tmp_path.iterdir()] == ["s.yaml"]


@pytest.mark.full
@pytest.mark.parametrize("way", ["option", "environment"])
def test_traceback_on_request(undertow, tmp_path, monkeypatch, way):
    monkeypatch.setenv("UNDERTOW_TRACEBACK", "1" if way == "environment" else "")
    monkeypatch.setattr(simulate, "run_scenario", raising(RuntimeError("broken")))
    write(tmp_path)
    said = undertow(*(["--traceback"] if way == "option" else []), "simulate", "s.yaml", "--out", "out")
    assert said.code == 3 and "Traceback" in said.err


@pytest.mark.full
def test_full_disk_is_4(undertow, tmp_path, monkeypatch):
    monkeypatch.setattr(netcdf, "save", raising(OSError(28, "No space left on device", "run.nc")))
    write(tmp_path, SMALL)
    said = undertow("simulate", "s.yaml", "--out", "out")
    line = "Error: files could not be read or written: No space left on device (run.nc)"
    assert said.code == 4
    assert said.err.splitlines()[-1] == line
    assert [path.name for path in tmp_path.iterdir()] == ["s.yaml"]


@pytest.mark.full
def test_interrupt_is_130(undertow, tmp_path, monkeypatch):
    monkeypatch.setattr(simulate, "run_scenario", raising(KeyboardInterrupt()))
    write(tmp_path)
    assert undertow("simulate", "s.yaml", "--out", "out").code == 130
    assert [path.name for path in tmp_path.iterdir()] == ["s.yaml"]


@pytest.mark.full
def test_interrupt_of_compiled_code(tmp_path):
    """Hours of simulated time end at once, and leave nothing."""
    write(tmp_path, HOURS)
    command = [sys.executable, "-m", "undertow", "simulate", "s.yaml", "--out", "out"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line.startswith("building"):
                break
        time.sleep(1)
        process.send_signal(2)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert err == "\nInterrupted: stopping.\nNo results were written to out.\n"
    assert os.listdir(tmp_path) == ["s.yaml"]


@pytest.mark.full
def test_bad_input_as_a_process(tmp_path):
    write(tmp_path, SCENARIO.replace("mass: 125", "mass: -1"))
    command = [sys.executable, "-m", "undertow", "simulate", "s.yaml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "Error: `plant.vehicle.mass` must be positive, but is -1 kg (s.yaml, line 2)\n"
    assert os.listdir(tmp_path) == ["s.yaml"]


@pytest.mark.full
@pytest.mark.parametrize("command", ["list", "describe robust", "describe scenario --json-schema"])
def test_a_reader_that_ends_early_is_no_error(command):
    """As `undertow list | head -1`: the exit code of the signal, and nothing on stderr."""
    code = [sys.executable, "-m", "undertow", *command.split()]
    with subprocess.Popen(code, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 141


SWALLOWED = """
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    pass
"""


@pytest.mark.full
@pytest.mark.parametrize("interrupted", [SWALLOWED, "import interrupted; assert interrupted.whole"])
def test_an_interrupt_that_was_not_heard_ends_the_next_wait(tmp_path, interrupted):
    """Swallowed by compiled code that calls back into Python, or put off as it came while a module was imported."""
    (tmp_path / "interrupted.py").write_text("import signal; signal.raise_signal(signal.SIGINT); whole = 'whole'")
    code = f"""
import signal, sys, time
from undertow.cli.interruptible import interruptible, remember_interrupts
sys.path.insert(0, {str(tmp_path)!r})
remember_interrupts()
{interrupted}
try:
    interruptible(lambda: time.sleep(30))
except KeyboardInterrupt:
    print("ended")
"""
    began = time.monotonic()
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ended\n"
        process.kill()
    assert time.monotonic() - began < 25


IMPORTING = """
import sys, time
import importlib.abc

class Slow(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "undertow.cli.{module}":
            open("begun", "w").close()
            time.sleep(1.5)  # as long as JAX takes on a slow disk

sys.meta_path.insert(0, Slow())
sys.argv = ["undertow", *{arguments}]
from undertow.cli.main import main
main()
"""
EVERY = {
    "reproduce": ("reproduce", ["reproduce", "--out", "out"]),
    "check": ("check", ["check", "s.yaml"]),
    "describe": ("describe", ["describe", "odin"]),
    "list": ("describe", ["list"]),
    "simulate": ("simulate", ["simulate", "s.yaml"]),
}


QUICK = {("list", 2), ("simulate", 15)}  # both signals, and a command that waits for compiled code


@pytest.mark.full
@pytest.mark.parametrize(
    ("command", "signal"),
    [
        pytest.param(command, signal, marks=() if (command, signal) in QUICK else pytest.mark.slow)
        for command in EVERY
        for signal in (2, 15)
    ],
)
def test_signals_while_modules_are_imported_end_every_command(tmp_path, command, signal):
    """It may not be forgotten by those that wait for no compiled code; SIGTERM ends like Ctrl-C, with its own code."""
    write(tmp_path)
    module, arguments = EVERY[command]
    code = IMPORTING.replace("{module}", module).replace("{arguments}", repr(arguments))
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as it:
        wait_for(tmp_path / "begun", it)
        it.send_signal(signal)
        out, err = it.communicate(timeout=60)
    assert it.returncode == 128 + signal, err
    # A command that knew its folder by then says that nothing is in it.
    assert re.fullmatch(rb"\nInterrupted: stopping\.\n(No results were written to \S+\.\n)?", err), (out, err)
    assert sorted(os.listdir(tmp_path)) == ["begun", "s.yaml"]


@pytest.mark.full
def test_sigterm_leaves_nothing_of_a_run(tmp_path):
    """Nor does the lock stay, nor the folder that results were to appear in."""
    write(tmp_path, HOURS)
    command = [sys.executable, "-m", "undertow", "simulate", "s.yaml"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if line.startswith("building"):
                break
        assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == [".s.lock", ".s.partial"]
        process.terminate()
        _, err = process.communicate(timeout=60)
    assert process.returncode == 143 and "Traceback" not in err
    assert os.listdir(tmp_path) == ["s.yaml"]


def wait_for(path, process):
    while not path.exists() and process.poll() is None:
        time.sleep(0.01)
