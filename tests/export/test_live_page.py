"""The module of the page computes what a simulation does, and what a visitor changes is a scenario with that change."""

import numpy as np
import pytest
from export.live_page import in_node, page, page_data
from export.scenarios import NAVIGATED

import undertow as ut
from undertow.outside.browser import wasm
from undertow.outside.browser.browser_page import export_page
from undertow.scenario.build import build
from undertow.scenario.results.run_scenario import run_scenario

pytestmark = pytest.mark.compiler

STEPS = 400
KILLED = 150  # step, 1.5 s
COMPARED = ("position", "reference", "error", "acting_input", "uncertainty", "estimate")


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """As it is; with a thruster that is killed; in lower waves from the start; with a payload that is picked up."""
    wave = next(slider for slider in page_data()["laws"][0]["loop"]["sliders"] if slider["label"] == "wave height")
    changes = [
        [],
        [{"at": KILLED, "label": "thruster 3", "time": 0.01 * KILLED}],
        [{"at": 0, "label": "wave height", "position": wave["shown"].index(0.25)}],
        [{"at": KILLED, "label": "payload", "time": 0.01 * KILLED}],
    ]
    return in_node(tmp_path_factory.mktemp("node"), *({"steps": STEPS, "changes": one} for one in changes))


def compare(records, scenario):
    result = run_scenario(build(scenario))
    assert result.facts.left_to_xla == ""  # XLA rounds in its own way
    for name in COMPARED:
        recorded = name if name in result.series else name.removeprefix("acting_")  # where nothing can fail
        np.testing.assert_array_equal(records[name], result.series[recorded].values[:STEPS], err_msg=name)


def test_every_bit_is_that_of_a_simulation(runs):
    compare(runs[0], NAVIGATED)


def test_a_killed_thruster_is_the_fault_of_a_scenario(runs):
    compare(runs[1], NAVIGATED | {"faults": [{"target": "thruster 3", "mode": "off", "onset": 1.5}]})
    assert (runs[1]["acting_input"][KILLED:, 2] == 0).all() and (runs[0]["acting_input"][KILLED:, 2] != 0).all()
    assert not np.array_equal(runs[1]["position"][-1], runs[0]["position"][-1])


def test_a_dial_is_another_number_of_the_scenario(runs):
    current, waves = NAVIGATED["disturbance"]
    compare(runs[2], NAVIGATED | {"disturbance": [current, waves | {"height": 0.25}]})


def test_a_payload_is_that_of_a_scenario(runs):
    payload = {"kind": "payload", "mass": 2.0, "weight": 12.0, "start": 1.5}
    compare(runs[3], NAVIGATED | {"disturbance": [*NAVIGATED["disturbance"], payload]})


def test_nothing_is_loaded():
    text = page().split("</style>")[1]
    outside = text.split("<script>")[0] + text.rpartition("<script>")[2]
    assert "http" not in outside and "src=" not in outside and "import(" not in outside
    assert len(page_data()["laws"][0]["loop"]["switches"]) == 9


def test_without_the_compiler_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(wasm.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ut.BadInput, match=r"ziglang is not installed.*\n?.*\[wasm\]"):
        export_page({"robust": build(NAVIGATED)})
