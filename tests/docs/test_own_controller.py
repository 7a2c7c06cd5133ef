"""The law of the page `your-own-controller` is tuned by the ranges that it declares, and tries what it says of itself."""

import json

import numpy as np
import pytest
from test_blocks import FILE, ROOT, blocks

from undertow.cli.main import run
from undertow.core import catalogue
from undertow.core.param import tuning_ranges
from undertow.physics.plants import double_integrator
from undertow.scenario.checks.controller_check import check_stability
from undertow.scenario.reading import dump, from_data
from undertow.studies.tuning.problem import problem

pytestmark = pytest.mark.docs

AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20.0},
    "controller": {"kind": "./my_controller.py:my_controller", "layer": 0.2},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 1.0},
    "loop": {"duration": 2.0, "dt": 0.02, "record": 0.1},
    "tune": {"iterations": 1, "train": {"seeds": 1}, "held_out": {"seeds": 1}},
}


@pytest.fixture
def own_law(tmp_path, monkeypatch):
    """The file of the page in the current folder."""
    page = ROOT / "docs" / "how-to" / "your-own-controller.md"
    (code,) = [
        block.code for block in blocks(page) if (at := FILE.match(block.code)) and at["name"] == "my_controller.py"
    ]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_controller.py").write_text(code)


def test_declared_ranges_are_tuned(own_law):
    found = problem(from_data(AXIS))
    bounds = {one.option: (one.low, one.high) for one in found.parameters}
    assert bounds == {"slope": (0.1, 5.0), "reaching": (0.05, 5.0), "layer": (0.02, 2.0)}
    assert bounds == tuning_ranges(found.built.closed_loop.controller)
    begun = {name: float(np.squeeze(value)) for name, value in found.options(found.start).items()}
    assert begun == pytest.approx({"slope": 2.0, "reaching": 3.0, "layer": 0.2}, rel=1e-6)


def test_ranges_of_the_scenario_take_their_place(own_law):
    (only,) = problem(from_data(AXIS | {"tune": AXIS["tune"] | {"parameters": {"slope": [0.5, 2.0]}}})).parameters
    assert (only.option, only.low, only.high) == ("slope", 0.5, 2.0)


def test_a_file_is_one_module_until_its_contents_change(own_law, tmp_path):
    first, again = (catalogue.find("controllers", "./my_controller.py:my_controller") for _ in range(2))
    assert first is again
    code = (tmp_path / "my_controller.py").read_text()
    (tmp_path / "my_controller.py").write_text(code.replace("slope=2.0", "slope=1.0"))
    other = catalogue.find("controllers", "./my_controller.py:my_controller")
    model = double_integrator(1).model()
    assert (float(first(model).slope), float(other(model).slope)) == (2.0, 1.0)


@pytest.mark.parametrize(("kind", "options"), [("pid", {"frequency": 2.0}), ("rcaf", {"preset": "robust"})])
def test_stable_laws_get_no_advice(kind, options):
    plant = double_integrator(2)
    assert list(check_stability(catalogue.find("controllers", kind)(plant.model(), **options), plant)) == []


def test_radius_of_the_wrong_sign_is_that_of_the_closed_form(own_law, tmp_path):
    """Inside the layer s_dot = -(K / phi) s holds; with u reversed the poles solve (s + l)^2 (s + k) = 2 s^3."""
    code = (tmp_path / "my_controller.py").read_text()
    (tmp_path / "my_controller.py").write_text(code.replace("invert(y, acc", "invert(y, -acc"))
    plant, dt, rate, slope = double_integrator(1), 1e-4, 3.0 / 0.3, 2.0
    law = catalogue.find("controllers", "./my_controller.py:my_controller")(plant.model())
    (found,) = check_stability(law, plant, dt)
    poles = np.roots(np.poly([-slope, -slope, -rate]) - [2, 0, 0, 0])
    said = float(found.says.split("spectral radius of ")[1].split()[0])
    assert np.log(said) / dt == pytest.approx(poles.real.max(), rel=0.01)
    assert found.level == "advice" and "opposite sign" in found.hint


@pytest.mark.slow
def test_it_is_tuned(own_law, tmp_path):
    (tmp_path / "axis.yaml").write_text(dump(AXIS))
    assert run(["tune", "axis.yaml", "--out", "tuned"]) == 0
    gains = json.loads((tmp_path / "tuned" / "tuning.json").read_text())["gains"]
    assert gains["tuned"]["train_cost"] < 0.5 * gains["given"]["train_cost"]
    assert run(["simulate", "tuned/tuned.yaml", "--no-prediction", "--out", "out"]) == 0
