"""`undertow check`: vehicle files, catalogue names, parts from a file, scenarios."""

from pathlib import Path

import pytest
from good_scenario import SCENARIO, SMALL

from undertow.core import catalogue
from undertow.scenario.checks import check

EXAMPLES = Path(__file__).parents[2] / "examples"
SLOW = {("disturbances", "gauss_markov_current"), ("disturbances", "random_suite")}  # long to compile
PARTS = [(kind, name) for kind in ("plants", "controllers", "disturbances") for name in catalogue.names(kind)]

CIRCLE = """
import jax.numpy as jnp
from undertow.core.contracts import {contract}, Target


class Mine({contract}):
    def at(self, t):
        return Target(jnp.sin(t) * jnp.ones(6), {velocity}, -jnp.sin(t) * jnp.ones(6))


def mine():
    return Mine()
"""


def test_sound_vehicle_file(undertow):
    said = undertow("check", str(EXAMPLES / "my_rov.yaml"))
    assert said.code == 0 and said.err == ""
    answer = said.out[said.out.index("my_rov.yaml: 0 errors") :].splitlines()
    assert answer == [
        "my_rov.yaml: 0 errors, 0 pieces of advice. It can be used, and nothing in it is implausible.",
        "Its mass is 13.5 kg. Without thrust it sinks: it is 0.98 N (0.74 %) heavier than the water it displaces.",
        "Tilted by 10 degrees in roll or pitch, it is righted by 0.23 N m.",
        "Its drag at 1 m/s is 155 N forward, 217 N sideways and 223 N vertically.",
        "Its 8 thrusters control all six degrees of freedom.",
        f"Next: `undertow init --vehicle {EXAMPLES / 'my_rov.yaml'}` writes a scenario for it.",
    ]
    assert "righting moment" in said.out and "1.316" in said.out


def test_vehicle_file_with_another_value(undertow):
    said = undertow("check", str(EXAMPLES / "my_rov.yaml"), "--option", "r_b=[0, 0, 0.01]", "--option", "mass=14")
    assert said.code == 2 and said.err == ""
    first, *_, verdict, begin, following = said.out.splitlines()
    assert first.startswith(
        "Error: `r_b` must be above the centre of gravity, but is 10 mm below it (my_rov.yaml, line 12)"
    )
    assert verdict.endswith(": 1 error, 1 piece of advice. It cannot be used like this.")
    assert begin == f"Begin with: {first.removeprefix('Error: ')}."
    assert following == "Next: mend this, and check again."


def test_buoyancy_that_follows_from_the_volume_has_its_line(undertow):
    said = undertow("check", str(EXAMPLES / "my_rov.yaml"), "--option", "volume=13.4")
    assert said.out.startswith("Error: `buoyancy` must be of the order of the weight, but is 1.3159e+05 N")
    assert "(my_rov.yaml, line 9)" in said.out.splitlines()[0]


def test_variant_of_a_catalogue_vehicle(undertow):
    said = undertow("check", "bluerov2_heavy", "--option", "parameters=ng2024")
    assert said.code == 0
    assert said.out.startswith(
        "Advice: `inertia` should give a radius of gyration below 0.225 m in yaw, but is one of 0.295 m"
    )
    assert undertow("check", "vehicles/bluerov2_heavy", "--option", "parameters=wu2018").out.count("Advice") == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["oddin"], "`oddin` must be a .yaml file, or the name of a part, but is not. Did you mean `odin`?"),
        (["bluerov2_heavy", "--option", "parameters=wu"], "`parameters` must be one of vonbenzon2022, wu2018"),
        (["bluerov2_heavy", "--option", "parameters"], "`--option` must be KEY=VALUE, but is parameters"),
        (["bluerov2_heavy", "--option", "mas=3"], "`mas` must be an option or parameter here, but is unknown"),
        (["./mine.py:mine"], "`./mine.py` must be an existing file, but is not"),
        (["s.nc"], "`s.nc` must be an existing file, but is not"),
    ],
)
def test_bad_argument(refused, arguments, said):
    assert refused("check", *arguments).startswith(said)


def test_a_path_with_colons(tmp_path):
    (tmp_path / "10:30.py").write_text("def limit():\n    return 7\n")
    assert catalogue.find("plants", "./10:30.py:limit", tmp_path)() == 7


def test_file_that_is_neither(refused, tmp_path):
    (tmp_path / "x.yaml").write_text("masss: 3\n")
    said = "`x.yaml` must be a vehicle, scenario or campaign file, but is without a key of any. Did you mean `mass`?"
    assert refused("check", "x.yaml") == said


@pytest.mark.full
def test_scenario(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    said = undertow("check", "s.yaml")
    assert said.code == 0
    assert said.out.count("Advice: torque constant / back-EMF constant is 117") == 1
    assert "odin (vehicle)" in said.out


@pytest.mark.full
def test_campaign(undertow, tmp_path):
    """As `undertow campaign` checks it before the first trial; nothing is run or written."""
    (tmp_path / "s.yaml").write_text(SMALL)
    (tmp_path / "c.yaml").write_text("scenario: s.yaml\ntrials: 8\nrequirements: {position_rms: {below: 1}}\n")
    said = undertow("check", "c.yaml")
    assert said.code == 0 and said.out.startswith("Advice: `requirements.position_rms.share` is 0.95, which takes")
    verdict, trials, following = said.out.splitlines()[1:]
    assert verdict == "c.yaml: 0 errors, 1 piece of advice. It can be run, but look at the advice first."
    assert trials == "It has 8 trials." and following == "Next: undertow campaign c.yaml"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["c.yaml", "s.yaml"]


@pytest.mark.full
def test_vehicle_of_a_scenario(undertow, tmp_path):
    rov = (EXAMPLES / "my_rov.yaml").read_text()
    (tmp_path / "my_rov.yaml").write_text(rov.replace("inertia: [0.26, 0.23, 0.37]", "inertia: [26, 23, 37]"))
    (tmp_path / "s.yaml").write_text(SCENARIO.replace("{kind: odin, mass: 125}", "my_rov.yaml"))
    said = undertow("check", "s.yaml")
    assert said.code == 2
    assert said.out.startswith(
        "Error: `inertia` must give a radius of gyration below 0.261 m in pitch, but is one of 1.31 m (my_rov.yaml, line 14)"
    )


def test_bad_scenario(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO.replace("duration: 0.1", "duration: -1"))
    assert refused("check", "s.yaml").startswith("`loop.duration` must be greater than 0, but is -1")
    (tmp_path / "s.yaml").write_text(SCENARIO)
    said = "`--option` must be left out for a scenario, but is seed"
    assert refused("check", "s.yaml", "--option", "seed=4") == said


@pytest.mark.full
@pytest.mark.parametrize(
    ("kind", "name"), [pytest.param(*one, marks=pytest.mark.slow) if one in SLOW else one for one in PARTS]
)
def test_parts_of_the_catalogue_keep_their_contract(undertow, monkeypatch, kind, name):
    """Without the feedback of a law, which gives advice, never an error, and takes longest: tests/docs/test_own_controller."""
    monkeypatch.setattr(check, "_of_feedback", lambda make, axes: check.Report((), ()))
    needed = {
        "table": ["--option", "samples=[[0, 0, 0, 0, 0, 0, 0], [20, 1, 1, 1, 1, 1, 1]]"],
        "experiment": ["--option", "samples=[[0, 0, 0, 0, 0, 0, 0], [20, 1, 1, 1, 1, 1, 1]]", "--option", "law=pid"],
        "policy": ["--option", f"function={Path(__file__).parents[1]}/conformance/proportional_policy.py:act"],
        "rcaf": ["--option", "preset=paper"],
        "replay": ["--option", "commands=[[0, 0, 0, 0, 0, 0, 0, 0, 0], [20, 1, 1, 1, 1, 1, 1, 1, 1]]"],
    }
    said = undertow("check", f"{kind}/{name}", *needed.get(name, []))
    assert said.code == 0, said


@pytest.mark.full
@pytest.mark.parametrize("name", sorted(catalogue.names("references")))
def test_references_are_consistent(undertow, name):
    samples = "[[0, 0, 0, 0, 0, 0, 0], [5, 1, 0, 1, 0, 0, 0.3], [10, 1, 2, 1, 0, 0, 0]]"
    needed = {
        "setpoint": ["position=[1, 2, 3, 0, 0, 0]"],
        "waypoints": ["points=[[0, 0, 0], [2, 0, 1], [2, 2, 1]]"],
        "recorded": [f"samples={samples}"],
    }
    options = [word for option in needed.get(name, []) for word in ("--option", option)]
    said = undertow("check", f"references/{name}", *options)
    assert said.code == 0, said


def test_part_from_a_file_that_keeps_its_contract(undertow, tmp_path):
    code = CIRCLE.format(contract="AbstractReference", velocity="jnp.cos(t) * jnp.ones(6)")
    (tmp_path / "mine.py").write_text(code)
    assert undertow("check", "./mine.py:mine").code == 0


def test_part_from_a_file_that_does_not(undertow, tmp_path):
    code = CIRCLE.format(contract="AbstractReference", velocity="-jnp.cos(t) * jnp.ones(6)")
    (tmp_path / "mine.py").write_text(code)
    said = undertow("check", "./mine.py:mine")
    assert said.code == 2
    assert said.out.startswith("Error: `at` must agree with the rate of the position at 0.37 s, but is -0.932")


TERMINAL = """
import jax.numpy as jnp
from undertow.core.contracts import AbstractController, Model


class Terminal(AbstractController):
    model: Model

    def init(self, y, r):
        return ()

    def command(self, z, y, r):
        off = self.model.coordinates.tracking_error(y, r)
        print("error", off.error)
        return self.model.dynamics.invert(y, jnp.sign(off.error) * jnp.abs(off.error) ** 0.6 + off.rate), {}

    def advance(self, z, y, r, u, dt):
        return z

    def signals(self):
        return {}


def terminal(model):
    return Terminal(model)
"""


@pytest.mark.full
def test_a_law_that_prints_and_has_no_slope_gets_advice(undertow, tmp_path):
    (tmp_path / "law.py").write_text(TERMINAL)
    said = undertow("check", "law.py:terminal")
    assert said.code == 0 and "error JitTracer(float64[6])" in said.out
    assert "`Terminal` prints `JitTracer(float64[6])`, once, while it is compiled, and never again" in said.out
    assert "`command` should have a finite slope where the error is zero" in said.out
    scenario = "plant: double_integrator\nreference: {kind: setpoint, position: [1]}\ncontroller: ./law.py:terminal\n"
    (tmp_path / "s.yaml").write_text(scenario)
    assert "`command` should have a finite slope where the error is zero" in undertow("check", "s.yaml").out
    smooth = TERMINAL.replace("print(", "repr((").replace("off.error)\n", "off.error))\n", 1)
    smooth = smooth.replace("jnp.sign(off.error) * jnp.abs(off.error) ** 0.6", "off.error")
    (tmp_path / "law.py").write_text(smooth)
    assert "finite slope" not in undertow("check", "s.yaml").out
    *_, verdict, following = undertow("check", "law.py:terminal").out.splitlines()
    assert verdict.startswith("law.py:terminal: 0 errors, 0 pieces of advice. It can be used")
    assert following.startswith("Next: write `controller: law.py:terminal` in a scenario")


def test_part_from_a_file_that_is_none(refused, tmp_path):
    (tmp_path / "mine.py").write_text("def mine():\n    return 7\n")
    said = "`mine` returns 7, which is not a part. Return a vehicle, thruster, plant, controller or another part"
    assert refused("check", "./mine.py:mine") == said


def test_vehicle_from_a_python_file(undertow, tmp_path):
    (tmp_path / "mine.py").write_text(
        "import equinox as eqx\nimport undertow as ut\n\n\n"
        "def mine():\n    return eqx.tree_at(lambda v: v.weight, ut.vehicles.odin(), 125.0)\n"
    )
    said = undertow("check", "./mine.py:mine")
    assert said.code == 2
    assert said.out.startswith(
        "Error: `weight` must be the weight of the mass, 1226 N, but is 125 N, 1 m/s^2 times 125 kg. Is"
    )


@pytest.mark.full
def test_result_file_is_the_scenario_in_it(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(SMALL)
    assert undertow("simulate", "s.yaml", "--out", "out").code == 0
    of_scenario, of_result = undertow("check", "s.yaml"), undertow("check", "out/run.nc")
    assert of_result.code == of_scenario.code == 0
    assert of_result.out == of_scenario.out.replace("s.yaml", "out/run.nc")


@pytest.mark.full
def test_thruster_from_a_python_file(undertow, tmp_path):
    (tmp_path / "mine.py").write_text(
        "import undertow as ut\n\n\ndef mine(gain: float = -5.0):\n    return ut.thrusters.linear_voltage(gain)\n"
    )
    said = undertow("check", "./mine.py:mine", "--option", "gain=5.0")
    assert said.code == 0 and "mine (thruster)" in said.out
