"""Mistakes of a first hour: each is one line that names the place and the remedy, or advice before the run."""

import shutil
from pathlib import Path

import pytest

from undertow.cli import simulate
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.part_cache import PartCache

pytestmark = pytest.mark.full

EXAMPLES = Path(__file__).parents[2] / "examples"
TEMPLATE = Path(simulate.__file__).parents[1] / "scenario/templates/my_controller.py"

SCENARIO = """\
plant:
  vehicle: my_rov.yaml
  thruster: {kind: t200, fidelity: static, supply: 16}
controller: {kind: pid, frequency: 1}
reference: {kind: setpoint, position: [2, 0, 1, 0, 0, 0.5]}
disturbance:
  - {kind: current, velocity: [0.3, 0, 0]}
loop:
  duration: 20
  dt: 0.01
  record: 0.05
"""
LAW = """\
import undertow as ut


def my_law(model):
    return ut.controllers.pid(model, frequency=1.0)
"""
CAMPAIGN = "scenario: s.yaml\ntrials: 2\n"

SIMULATE, CHECK = ("simulate", "s.yaml", "--out", "out"), ("check", "my_rov.yaml")
OWN = ("simulate", "with_law.yaml", "--out", "out")  # with the law of `undertow init --own-controller` in law.py
CONTROLLER = "controller: {kind: pid, frequency: 1}"

# The mistake: what is typed, in which file what is replaced by what, and what the line must have.
ERRORS = {
    "tab": (SIMULATE, "s.yaml", "  dt: 0.01", "\tdt: 0.01", ["s.yaml, line 10", "tab", "Indent with spaces"]),
    "indented too far": (SIMULATE, "s.yaml", "  dt: 0.01", "   dt: 0.01", ["s.yaml, line 10", "same column"]),
    "indented too little": (SIMULATE, "s.yaml", "  dt: 0.01", " dt: 0.01", ["s.yaml, line 10", "same column"]),
    "no colon": (SIMULATE, "s.yaml", "  dt: 0.01", "  dt 0.01", ["s.yaml, line 10", "`key: value`"]),
    "no space after the colon": (SIMULATE, "s.yaml", "  dt: 0.01", "  dt:0.01", ["s.yaml, line 10", "space"]),
    "key with brackets": (("campaign", "c.yaml"), "c.yaml", "trials: 2", "variants: {a: {reference.position[0]: 2}}", ["c.yaml, line 2", 'Inside braces, quote a key that has brackets: {"reference.position[0]": 2}']),
    "bracket": (SIMULATE, "s.yaml", "0, 0.5]}", "0, 0.5}", ["s.yaml, line 5", "`[` is not closed", "Add `]`"]),
    "same key twice": (SIMULATE, "s.yaml", "  dt: 0.01", "  duration: 5", ["s.yaml, line 10", "`duration`", "line 9"]),
    "vehicle file to simulate": (("simulate", "my_rov.yaml"), "", "", "", ["`my_rov.yaml`", "`plant: {vehicle: my_rov.yaml}`"]),
    "campaign to simulate": (("simulate", "c.yaml"), "", "", "", ["`c.yaml`", "is a campaign", "undertow campaign c.yaml"]),
    "scenario to campaign": (("campaign", "s.yaml"), "", "", "", ["`s.yaml`", "is a scenario", "undertow simulate s.yaml"]),
    "vehicle file to campaign": (("campaign", "my_rov.yaml"), "", "", "", ["`my_rov.yaml`", "is a vehicle file"]),
    "scenario as the vehicle": (SIMULATE, "s.yaml", "vehicle: my_rov.yaml", "vehicle: other.yaml", ["s.yaml, line 2", "other.yaml, a scenario"]),
    "text file": (("simulate", "notes.txt"), "", "", "", ["`notes.txt`", "notes.yaml"]),
    "Python file to simulate": (("simulate", "law.py:my_controller"), "", "", "", ["`law.py:my_controller`", "named in a scenario, such as `controller: ./file.py:function`"]),
    "log to simulate": (("simulate", "dive.csv"), "", "", "", ["`dive.csv`", "`undertow logs dive.csv`"]),
    "log to check": (("check", "dive.csv"), "", "", "", ["`dive.csv`", "`undertow logs score SCENARIO dive.csv`"]),
    "log without a mapping": (("logs", "dive.csv"), "", "", "", ["`mapping` must be given", "`--mapping FILE`", "columns (t, x"]),
    "vehicle file without its ending": (("init", "--vehicle", "my_rv"), "", "", "", ["`--vehicle`", "Did you mean `my_rov.yaml`?"]),
    "text file to check": (("check", "notes.txt"), "", "", "", ["`notes.txt`", "notes.yaml"]),
    "ending left out to check": (("check", "my_rov"), "", "", "", ["`my_rov`", "Did you mean `my_rov.yaml`?"]),
    "file of another name to check": (("check", "vehicle.yaml"), "", "", "", ["`vehicle.yaml`", "Files there: binary.yaml, c.yaml"]),
    "result that is empty": (("simulate", "old/run.nc"), "", "", "", ["`old/run.nc`", "is empty (0 bytes)", "Run its scenario again"]),
    "folder": (("check", "."), "", "", "", [".", "a folder", "my_rov.yaml", "s.yaml"]),
    "folder to simulate": (("simulate", "."), "", "", "", [".", "a folder", "my_rov.yaml", "s.yaml"]),
    "missing file": (("simulate", "my_rv.yaml"), "", "", "", ["my_rv.yaml", "`my_rov.yaml`"]),
    "ending left out": (("simulate", "my_rov"), "", "", "", ["my_rov", "`my_rov.yaml`"]),
    "missing folder": (("simulate", "there/s.yaml"), "", "", "", ["there/s.yaml", "folder there does not exist"]),
    "empty file": (("simulate", "empty.yaml"), "", "", "", ["empty.yaml", "empty", "`undertow describe scenario`"]),
    "binary file": (("simulate", "binary.yaml"), "", "", "", ["binary.yaml", "UTF-8"]),
    "misspelt command": (("simulte", "s.yaml"), "", "", "", ["simulte", "Did you mean 'simulate'?"]),
    "misspelt option": (("simulate", "s.yaml", "--overwite"), "", "", "", ["--overwite", "--overwrite"]),
    "misspelt key": (SIMULATE, "s.yaml", "controller:", "contoller:", ["`contoller`", "s.yaml, line 4", "`controller`"]),
    "key in no section": (SIMULATE, "s.yaml", "  record: 0.05", "record: 0.05", ["`record`", "s.yaml, line 11", "`loop: {record: ...}`"]),
    "vehicle in no section": (SIMULATE, "s.yaml", CONTROLLER, "vehicle: odin", ["`vehicle`", "s.yaml, line 4", "`plant`"]),
    "end time": (SIMULATE, "s.yaml", "duration: 20", "t_final: 20", ["`loop.t_final`", "s.yaml, line 9", "Did you mean `duration`?"]),
    "time step at the top": (SIMULATE, "s.yaml", "loop:", "time_step: 0.01\nloop:", ["`time_step`", "s.yaml, line 8", "Write `loop: {dt: ...}`"]),
    "gains at the top": (SIMULATE, "s.yaml", "loop:", "gains: 3\nloop:", ["`gains`", "s.yaml, line 8", "Write `controller: {kind: ..., gains: ...}`"]),
    "part for a key": (SIMULATE, "s.yaml", "reference: ", "setpoint: ", ["`setpoint`", "s.yaml, line 5", "one of the references", "`reference`"]),
    "several mistakes": (SIMULATE, "s.yaml", (CONTROLLER, "duration: 20", "dt: 0.01"), ("trajectory: 1", "duration: 20s", "dtt: 0.01"), ["`trajectory`", "s.yaml, line 4", "`reference`? Also wrong: `loop.dtt` (line 10), `loop.duration` (line 9)"]),
    "grid of a campaign": (("campaign", "c.yaml"), "c.yaml", "trials: 2", "grid: {loop.dt: [0.01, 0.02]}", ["`grid`", "c.yaml, line 2", "`cross`"]),
    "trials of a campaign": (("campaign", "c.yaml"), "c.yaml", "trials", "monte_carlo", ["`monte_carlo`", "c.yaml, line 2", "`trials`"]),
    "distribution": (("campaign", "c.yaml"), "c.yaml", "trials: 2", "vary: {plant.vehicle.mass: {gaussian: [13, 1]}}", ["gaussian`", "c.yaml, line 2", "`normal`"]),
    "range without its distribution": (("campaign", "c.yaml"), "c.yaml", "trials: 2", "vary: {plant.vehicle.mass: [13, 14]}", ["c.yaml, line 2", "such as {uniform: [13, 14]}"]),
    "bounds swapped": (("campaign", "c.yaml"), "c.yaml", "trials: 2", "vary: {plant.vehicle.mass: {uniform: [0.3, -0.3]}}", ["low below high", "is {uniform: [0.3, -0.3]}", "c.yaml, line 2"]),
    "metric of a requirement": (("campaign", "c.yaml"), "c.yaml", "trials: 2", "trials: 2\nrequirements: {positon_rms: {below: 1}}", ["c.yaml, line 3", "`position_rms`"]),
    "list of another name": (("campaign", "c.yaml"), "c.yaml", "trials: 2", "vary:\n  velocities[0]: {uniform: [0, 1]}", ["c.yaml, line 3", "has no `velocities`", "Did you mean `disturbance[0].velocity`?"]),
    "nothing to resume": (("campaign", "c.yaml", "--resume", "--out", "none"), "", "", "", ["`--resume`", "none in none", "Leave --resume out"]),
    "key of the scenario in a campaign": (("campaign", "c.yaml"), "c.yaml", "trials", "metrics", ["`metrics`", "c.yaml, line 2", "key of the scenario"]),
    "first argument of a controller": (("check", "./mine.py:my_law"), "mine.py", "def my_law(model):\n    return ut.controllers.pid(model,", "class Mine(ut.core.contracts.AbstractController):\n    pass\n\n\ndef my_law(plant):\n    return ut.controllers.pid(plant.model(),", ["must be `model`", "`plant`", "mine.py, line 8"]),
    "capital letters": (SIMULATE, "s.yaml", "kind: t200", "kind: T200", ["`plant.thruster.kind`", "s.yaml, line 3", "`t200`"]),
    "capital letters of a vehicle": (SIMULATE, "s.yaml", "my_rov.yaml", "BlueROV2", ["s.yaml, line 2", "`bluerov2`"]),
    "unknown preset": (SIMULATE, "s.yaml", CONTROLLER, "controller: {kind: rcaf, preset: fast}", ["`controller.preset`", "s.yaml, line 4", "paper, robust"]),
    "disturbance in a list": (SIMULATE, "s.yaml", "kind: current", "kind: curent", ["`disturbance[0].kind`", "s.yaml, line 7", "`current`"]),
    "unit in a number": (SIMULATE, "s.yaml", "duration: 20", "duration: 20s", ["`loop.duration`", "s.yaml, line 9", "number alone"]),
    "decimal comma": (SIMULATE, "s.yaml", "dt: 0.01", "dt: 0,01", ["`loop.dt`", "s.yaml, line 10", "decimal point: 0.01"]),
    "number as text": (SIMULATE, "s.yaml", "dt: 0.01", "dt: '0.01'", ["`loop.dt`", "s.yaml, line 10", "without quotes: 0.01"]),
    "fraction of pi": (SIMULATE, "s.yaml", "0, 0.5]", "0, pi/2]", ["`reference.position`", "s.yaml, line 5", "1.5708"]),
    "no mass": (CHECK, "my_rov.yaml", "mass: 13.5", "", ["`mass` must be given: kg, in air"]),
    "direction in words": (CHECK, "my_rov.yaml", "azimuth: -45", "direction: forward", ["`thrusters[0].direction`", "is forward", "my_rov.yaml, line 25", "[1, 0, 0]"]),
    "negative mass": (CHECK, "my_rov.yaml", "mass: 13.5", "mass: -13.5", ["`mass`", "positive", "-13.5 kg", "my_rov.yaml, line 7"]),
    "unknown vehicle by its name alone": (SIMULATE, "s.yaml", "my_rov.yaml", "bluerov", ["`plant.vehicle` must be", "s.yaml, line 2", "`bluerov2`"]),
    "six outputs": (SIMULATE, "s.yaml", "[2, 0, 1, 0, 0, 0.5]", "[2, 0, 1, 0.5]", ["`reference.position`", "s.yaml, line 5", "north, east, down, roll, pitch, yaw"]),
    "three forces for six": (SIMULATE, "s.yaml", "{kind: current, velocity: [0.3, 0, 0]}", "{kind: wrench, value: [1, 0, 0]}", ["`disturbance[0].value`", "s.yaml, line 7", "surge, sway, heave, roll, pitch, yaw"]),
    "milliseconds": (SIMULATE, "s.yaml", "dt: 0.01", "dt: 10", ["`loop.dt`", "is 10 s", "s.yaml, line 10", "10 ms are 0.01"]),
    "several unknown options": (SIMULATE, "s.yaml", "{kind: current, velocity: [0.3, 0, 0]}", "{kind: payload, thruster: 1, factor: 0.5}", ["`disturbance[0].thruster`", "s.yaml, line 7", "Also unknown: `factor`"]),
    "sensor of another name": (SIMULATE, "s.yaml", "loop:", "navigation: {kind: observer, sensors: [imu, gps]}\nloop:", ["`navigation.sensors[1]`", "s.yaml, line 8", "`position_fix`"]),
    "record no multiple": (SIMULATE, "s.yaml", "record: 0.05", "record: 0.025", ["`loop.record`", "s.yaml, line 11", "0.02 or 0.03 s"]),
    "controller for another plant": (SIMULATE, "s.yaml", CONTROLLER, "controller: {kind: pid, frequency: [1, 2]}", ["`controller.frequency`", "s.yaml, line 4", "6"]),
    "file without its function": (SIMULATE, "s.yaml", CONTROLLER, "controller: ./mine.py", ["s.yaml, line 4", "./mine.py:my_law"]),
    "function of another name": (SIMULATE, "s.yaml", CONTROLLER, "controller: ./mine.py:my_lw", ["s.yaml, line 4", "`my_law`"]),
    "syntax error": (("check", "./mine.py:my_law"), "mine.py", "(model)", "(model", ["mine.py", "line 4", "SyntaxError"]),
    "file without its function to check": (("check", "law.py"), "", "", "", ["`law.py`", "Add its name: law.py:my_controller"]),
    "class for its function": (("check", "law.py:SlidingMode"), "", "", "", ["`slope`", "law.py, line 11", "is a class", "law.py:my_controller"]),
    "argument without a default": (OWN, "law.py", "slope=2.0", "slope", ["`controller.slope`", "law.py, line 46", "with_law.yaml, line 4", "`def my_controller(model, slope=1.0)`"]),
    "law for its maker": (OWN, "law.py", "my_controller(model, slope=2.0, reaching=3.0, layer=0.3)", "my_controller(y, r)", ["`controller.r`", "law.py, line 46", "takes `model` first", "undertow init --own-controller"]),
    "class without its contract": (OWN, "law.py", "(AbstractController)", "(__import__('equinox').Module)", ["returns a `SlidingMode` (law.py, line 11)", "with_law.yaml, line 4", "from AbstractController"]),
    "input without signals": (OWN, "law.py", 'return u, {"surface": s}', "return u", ["`SlidingMode.command` must return two values", "array of shape (8,)", "law.py, line 26"]),
    "input of another size": (OWN, "law.py", 'return u, {"surface": s}', 'return u[:6], {"surface": s}', ["`SlidingMode.command`", "an input of shape (8,)", "law.py, line 26"]),
    "state of another form": (OWN, "law.py", "return z + dt * jnp.where(jnp.abs(s) < self.layer, self.model.coordinates.tracking_error(y, r).error, 0.0)", "return z, s", ["`SlidingMode.advance`", "is a tuple, not an array", "law.py, line 32"]),
    "state on self": (OWN, "law.py", "return z + dt", "self.last = s\n        return z + dt", ["`self.last`", "`SlidingMode.advance`", "law.py, line 34", "with_law.yaml, line 4", "Try: undertow check law.py:my_controller"]),
    "if on a traced value": (OWN, "law.py", "nominal + self.reaching * jnp.clip(s / self.layer, -1, 1)", "nominal + (self.reaching if s[0] > 0 else -self.reaching)", ["law.py, line 28", "Use `jnp.where(condition, a, b)`, `jnp.minimum` or `jnp.maximum`. Try: undertow check law.py:my_controller"]),
    "method of another object": (OWN, "law.py", "self.model.coordinates.tracking_error(y, r)\n", "self.model.tracking_error(y, r)\n", ["law.py, line 38", "Did you mean `.coordinates.tracking_error`?"]),
    "slice of a measurement": (OWN, "law.py", "self.model.coordinates.tracking_error(y, r)\n", "r[:6] - y[:6], 0, 0\n", ["law.py, line 38", "`y.position` and `y.velocity`"]),
    "module that is missing": (("check", "./mine.py:my_law"), "mine.py", "import undertow", "import pandsa", ["mine.py, line 1", "Install `pandsa`"]),
    "sensor without the observer": (SIMULATE, "s.yaml", "loop:", "navigation: dvl\nloop:", ["`navigation`", "s.yaml, line 8", "`navigation.sensors`"]),
    "sensors at the top": (SIMULATE, "s.yaml", "loop:", "sensors: [imu, dvl]\nloop:", ["`sensors`", "s.yaml, line 8", "`navigation: {kind: kalman, sensors: ...}`"]),
    "observer without an IMU": (SIMULATE, "s.yaml", "loop:", "navigation: {kind: observer, sensors: [dvl]}\nloop:", ["`navigation.sensors`", "s.yaml, line 8", "Add `imu`"]),
    "file for --out": (("simulate", "s.yaml", "--out", "notes.txt"), "", "", "", ["`--out`", "notes.txt, a file", "another name"]),
    "results that exist": (("simulate", "s.yaml", "--out", "old"), "", "", "", ["`--out`", "old, which has run.nc", "--overwrite"]),
    "nowhere to write": (("simulate", "s.yaml", "--out", "/proc/out"), "", "", "", ["`--out`", "/proc/out", "Choose"]),
}  # fmt: skip


PARTS = PartCache()  # of the scenario above, made once for all tests


def prepare(folder, monkeypatch, file, old, new):
    if file not in ("my_rov.yaml", "law.py"):
        monkeypatch.setattr(simulate, "build", lambda text: build(text, PARTS))
    shutil.copy(EXAMPLES / "my_rov.yaml", folder)
    shutil.copy(TEMPLATE, folder / "law.py")
    (folder / "with_law.yaml").write_text(SCENARIO.replace(CONTROLLER, "controller: ./law.py:my_controller"))
    texts = {"s.yaml": SCENARIO, "other.yaml": SCENARIO, "c.yaml": CAMPAIGN, "mine.py": LAW, "notes.txt": SCENARIO}
    for name, text in (texts | {"empty.yaml": "# later\n"}).items():
        (folder / name).write_text(text)
    (folder / "dive.csv").write_text("t,x\n0,1\n1,2\n")
    (folder / "binary.yaml").write_bytes(b"\x89PNG\r\n\x1a\n\xff")
    (folder / "old").mkdir()
    (folder / "old" / "run.nc").touch()
    for one, other in zip([old] if isinstance(old, str) else old, [new] if isinstance(new, str) else new, strict=True):
        text = (folder / (file or "s.yaml")).read_text()
        assert one in text
        (folder / (file or "s.yaml")).write_text(text.replace(one, other, 1))


@pytest.mark.parametrize("mistake", ERRORS)
def test_mistake_names_place_and_remedy(refused, tmp_path, monkeypatch, mistake):
    arguments, file, old, new, named = ERRORS[mistake]
    prepare(tmp_path, monkeypatch, file, old, new)
    said = refused(*arguments)
    assert [one for one in named if one not in said] == [], said


@pytest.mark.parametrize("command", ["simulate", "analyze", "tune"])
def test_an_empty_folder_has_a_way_out(refused, command):
    assert refused(command, "scenario.yaml").endswith("but is not. `undertow init` writes a scenario to start from")


WAYPOINTS = "{kind: waypoints, points: [[0, 0, 0], [20, 0, 0], [20, 20, 0]], speed: 0.5}"
SETPOINT = "{kind: setpoint, position: [2, 0, 1, 0, 0, 0.5]}"
OBSERVER = "navigation: {kind: observer, sensors: [%s]}\nloop:"

# The mistake in s.yaml (or the vehicle file), and what the advice must have: the two numbers, and the remedy.
ADVICE = {
    "heading in degrees": ("s.yaml", "0, 0.5]", "0, 45]", ["`reference`", "(s.yaml, line 5)", "yaw at 45 rad", "7.16 turns", "0.7854 rad"]),
    "start in degrees": ("s.yaml", "loop:", "initial: {position: [0, 0, 0, 0, 0, 90]}\nloop:", ["`initial.position`", "(s.yaml, line 8)", "90 rad", "1.571 rad"]),
    "pitch in degrees": ("s.yaml", "0, 0.5]", "5, 0]", ["pitch", "5 rad (286.5 degrees)", "in radians"]),
    "height for depth": ("s.yaml", "[2, 0, 1,", "[2, 0, -5,", ["down = -5 m", "5 m above the start", "positive downward"]),
    "above the surface": ("s.yaml", "[0.3, 0, 0]}", "[0.3, 0, 0]}\n  - {kind: waves, depth: 0.5}\ninitial: {position: [0, 0, -2, 0, 0, 0]}", ["down = -2 m", "down = -0.5 m", "positive downward"]),
    "out of the water": ("s.yaml", "[0.3, 0, 0]}", "[0.3, 0, 0]}\n  - {kind: surface, depth: 0}", ["`initial.position`", "into the water with 44 % of its hull, but it floats with 100 %", "falls into the water"]),
    "two surfaces": ("s.yaml", "[0.3, 0, 0]}", "[0.3, 0, 0]}\n  - {kind: waves, depth: 3}\n  - {kind: surface, depth: 2}", ["`disturbance`", "as 3 m and as 2 m", "same `depth`"]),
    "current": ("s.yaml", "[0.3, 0, 0]", "[4, 3, 0]", ["current is 5 m/s", "(s.yaml, line 6)", "at most 1.32", "drifts away"]),
    "too far": ("s.yaml", "[2, 0, 1,", "[300, 0, 1,", ["300 m from the start", "(s.yaml, line 5)", "at most 1.32", "`loop.duration` more than 20 s"]),
    "beyond all squares": ("s.yaml", "[2, 0, 1,", "[1e200, 0, 1,", ["1e+200 m from the start", "at most 1.32", "`loop.duration` more than 20 s"]),
    "step": ("s.yaml", "[2, 0, 1,", "[25, 0, 1,", ["25.02 m from the vehicle", "at most 1.32", "`settling`"]),
    "too fast": ("s.yaml", SETPOINT, "{kind: circle, radius: 20, period: 20}", ["6.28 m/s", "at most 1.32"]),
    "waypoints in time": ("s.yaml", SETPOINT, WAYPOINTS, ["ends at 20 s", "(s.yaml, line 9)", "at 80 s", "`loop.duration`"]),
    "path from elsewhere": ("s.yaml", SETPOINT, "{kind: waypoints, points: [[0, 0, 3], [2, 0, 3]], speed: 0.5}", ["`reference` begins 3 m from the vehicle: at [0, 0, 3] m", "the vehicle starts at [0, 0, 0] m", "(s.yaml, line 5)", "`initial: {position: [0, 0, 3, 0, 0, 0]}`"]),
    "no compass, no position": ("s.yaml", "loop:", OBSERVER % "imu, dvl, depth", ["(s.yaml, line 8)", "0.013 m (north and east) and 0.051 degrees (yaw) in 20 s", "`position_fix` and `compass`"]),
    "long steps": ("s.yaml", "static", "electromechanical", ["0.437 ms", "10 ms", "(s.yaml, line 10)", "loop.substeps: 9"]),
    "radians of a thruster": ("my_rov.yaml", (": -45}", ": 45}", ": -135}", ": 135}"), (": -0.785}", ": 0.785}", ": -2.356}", ": 2.356}"), ["`thrusters[0].azimuth`", "-0.785", "-45 degrees in radians", "`thruster_matrix` contradicts", "(my_rov.yaml, line 25)", "Write -45"]),
    "supply beyond the table": ("s.yaml", "supply: 16", "supply: 160", ["`supply` is 160 V", "end at 20 V", "(s.yaml, line 3)"]),
    "size in mm": ("my_rov.yaml", "size: [0.457, 0.575, 0.254]", "size: [457, 575, 254]", ["`size`", "Is `size` in metres?", "(my_rov.yaml, line 6)"]),
}  # fmt: skip


class _Stop(BadInput):
    """Ends a command where it would compile and run."""


@pytest.mark.parametrize(
    "mistake", [pytest.param(one, marks=pytest.mark.slow) if "compass" in one else one for one in ADVICE]
)
def test_advice_names_its_numbers_and_the_remedy(undertow, tmp_path, monkeypatch, mistake):
    def stop(*arguments):
        raise _Stop("", "", "stopped")

    monkeypatch.setattr(simulate, "run_scenario", stop)
    file, old, new, named = ADVICE[mistake]
    prepare(tmp_path, monkeypatch, file, old, new)
    *advice, last = undertow(*SIMULATE).err.splitlines()
    assert last == "Error: Stopped" and len(advice) == 1 and advice[0].startswith("Advice: "), advice
    assert [one for one in named if one not in advice[0]] == [], advice
