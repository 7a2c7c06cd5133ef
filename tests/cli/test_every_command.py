"""One cheap path through every command: where its work is dear, its help and an input that it refuses."""

import subprocess
import sys

import pytest
import typer
from good_scenario import SMALL

from undertow.cli.main import app

FALSIFIED = (
    SMALL + "requirements: {position_rms: {below: 0.1}}\nfalsify: {vary: {disturbance.amplitude: {between: [0, 9]}}}\n"
)
# Lines in order, each with its exit code and with words that it says.
PATHS = {
    "init": [("init new --own-vehicle", 0, "cd new"), ("init new", 2, "`PATH` must be a place without these files")],
    "list": [("list", 0, "bluerov2_heavy"), ("list faults", 0, "kinds. `undertow describe faults/NAME`")],
    "describe": [("describe t200", 0, "t200 (thrusters)"), ("describe t20", 2, "`NAME` must be a part")],
    "check": [
        ("check bluerov2_heavy", 0, "bluerov2_heavy: 0 errors"),
        ("check bluerov2_heavy --option mas=3", 2, "`mas` must be an option or parameter here"),
    ],
    "version": [("version", 0, "undertow ")],
    "simulate": [
        ("simulate s.yaml --out run", 0, "It did not go well from"),
        ("simulate run/run.nc --out run", 2, "--overwrite"),
    ],
    "logs": [("logs layout", 0, "undertow-foxglove.json"), ("logs s.yaml", 2, "`log` must")],
    "analyze": [("analyze none.yaml", 2, "`none.yaml` must be an existing file")],
    "campaign": [("campaign s.yaml", 2, "is a scenario"), ("campaign status none", 2, "none")],
    "compare": [("compare s.yaml --controllers scenario,pidd", 2, "Did you mean `pid`?")],
    "falsify": [("falsify f.yaml --out broken", 2, "must hold in the nominal scenario, but is violated")],
    "identify-design": [
        ("identify-design s.yaml --prior mass=11", 2, "`--prior` must be NAME=VALUE+-DEVIATION"),
        ("identify-design s.yaml", 2, "`plant` must be a vehicle with thrusters"),
    ],
    "tune": [("tune s.yaml --method luck", 2, "`--method` must be one of gradient, search, evolution")],
    "identify": [
        ("identify", 2, "needs a SCENARIO and the LOGs"),
        ("identify --thruster none.csv", 2, "`bench` must be an existing file"),
        ("identify --thruster b.csv", 2, "Give it with --supply"),
    ],
    "arena": [("arena --tasks hover", 2, "`--tasks` must name tasks of the arena, but is hover")],
    "bench": [("bench s.yaml", 2, "unexpected extra argument")],
    "reproduce": [("reproduce --out s.yaml", 2, "`--out` must")],
    "run": [("run s.yaml --priority 100", 2, "`--priority` must be from 1 to 99")],
    "export": [("export s.yaml", 2, "`--c99` must be given")],
    "ardupilot": [("ardupilot s.yaml --duration 0", 2, "`duration` must be positive")],
    "mavlink": [("mavlink s.yaml --connect nowhere", 2, "nowhere")],
    "ros2": [("ros2 s.yaml --as pilot", 2, "`--as` must be one of controller, vehicle")],
}


def test_no_command_is_left_out():
    assert set(PATHS) == set(typer.main.get_command(app).commands)


@pytest.mark.parametrize("command", PATHS)
def test_one_path(undertow, tmp_path, command):
    (tmp_path / "s.yaml").write_text(SMALL)
    (tmp_path / "f.yaml").write_text(FALSIFIED)
    (tmp_path / "b.csv").write_text("pwm_us,thrust_N\n1500,0\n1900,40\n")
    for line, code, words in PATHS[command]:
        said = undertow(*line.split())
        assert said.code == code and words in said.out + said.err, (line, said)
        assert "Traceback" not in said.err
    helped = undertow(command, "--help")
    assert helped.code == 0 and f"undertow {command} [OPTIONS]" in helped.out and helped.err == ""


def test_entry_point():
    """As a process of its own, with what ends one."""
    command = [sys.executable, "-m", "undertow"]
    done = subprocess.run([*command, "version"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("undertow ") and done.stderr == ""
