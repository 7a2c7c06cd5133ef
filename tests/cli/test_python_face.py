"""The same one level down: `import undertow as ut`."""

import numpy as np
import pytest
from good_scenario import SCENARIO
from messages import named

import undertow as ut
from undertow.report.figures import run_files, writing
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

pytestmark = pytest.mark.full


@pytest.fixture(scope="module")
def parts():
    plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3(fidelity="ideal"))
    return plant, ut.rcaf(plant.model(), preset="paper"), ut.references.setpoint([2, 3, 4, 0, 0, 1])


def test_a_notebook_shows_the_answer_and_one_picture(parts):
    shown = ut.simulate(*parts, duration=0.1)._repr_html_()
    assert (
        shown.startswith('<div class="undertow">') and 'class="answer fails"' in shown and "It did not go well" in shown
    )
    assert shown.count("<img") == 1 and shown.count("<div") == shown.count("</div>")


def test_run_has_series_metrics_figures_and_a_page(parts, tmp_path, monkeypatch):
    run = ut.simulate(*parts, duration=0.1, seed=7)
    assert isinstance(run, ut.Run) and run.status == 0
    assert run.dataset["position"].shape == (11, 6) and run.dataset.attrs["seed"] == 7
    assert "controller_axes" not in run.dataset["axis"].attrs  # the paper's law: those of the outputs
    assert run.metrics["whole"]["position_max"] == pytest.approx(4.0)
    assert run.metrics["steady"]["position_max"] < 4.0
    assert "position_rms" in repr(run) and "completed at 0.1 s" in repr(run)
    assert "tracking" in run.plot()
    run.save(tmp_path / "run.nc")
    with pytest.raises(FileNotFoundError, match=r"The folder does not exist: .*none'$"):
        run.save(tmp_path / "none" / "run.nc")
    assert (tmp_path / "run.nc").is_file()
    monkeypatch.setattr(writing, "svg", lambda figure: "<svg/>")
    monkeypatch.setattr(writing, "png", lambda figure: b"")
    monkeypatch.setattr(run_files, "small_png", lambda figure: b"")
    run.page(tmp_path / "run.html")
    page = (tmp_path / "run.html").read_text()
    assert all(part in page for part in ('class="replay"', 'id="metrics"', 'id="certificate"', 'id="figure-tracking"'))


def test_python_and_scenario_agree_bit_for_bit(parts, tmp_path):
    (tmp_path / "s.yaml").write_text(SCENARIO)
    from_file = ut.simulate_scenario(tmp_path / "s.yaml")
    run = ut.simulate(*parts, disturbance=ut.disturbances.u1(), duration=0.1, seed=3, position=np.zeros(6))
    assert run.dataset.attrs["content_hash"] == from_file.dataset.attrs["content_hash"]


@pytest.mark.parametrize("law", ["robust", "pid", {"kind": "robust", "tracking": 1.5}])
def test_a_law_by_its_name_is_that_of_a_scenario(law):
    """Its gains follow from the sampling time and the noise of the navigation."""
    noise = {"position": 0.001, "velocity": 0.01}
    plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), ut.thrusters.t200(supply=16.0))
    navigation = ut.navigation.white_noise(**noise)
    goal = [1.0, 0, 0, 0, 0, 0.5]
    run = ut.simulate(
        plant, law, ut.references.setpoint(goal), navigation=navigation, dt=0.02, duration=0.2, record=0.1
    )
    scenario = {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16.0}},
        "controller": law,
        "reference": {"kind": "setpoint", "position": goal},
        "navigation": {"kind": "white_noise", **noise},
        "loop": {"dt": 0.02, "duration": 0.2, "record": 0.1},
    }
    expected = ut.simulate_scenario(scenario)
    assert run.dataset.attrs["content_hash"] == expected.dataset.attrs["content_hash"]


def test_without_a_controller_the_law_is_robust():
    scenario = {"plant": "double_integrator", "reference": {"kind": "setpoint", "position": [1.0]}}
    for change in ({}, {"controller": {"tracking": 1.5}}):
        law = build(from_data(scenario | change)).resolved["controller"]
        assert (law["kind"], law["preset"]) == ("rcaf", "robust")
    assert law["tracking"] == 1.5


def test_degrees_where_radians_are_due_are_said(parts):
    plant, law, _ = parts
    with pytest.warns(
        UserWarning, match="`reference` has yaw at 30 rad, which is 4.77 turns.*30 degrees are 0.5236 rad"
    ):
        ut.simulate(plant, law, ut.references.setpoint([0, 0, 0, 0, 0, 30]), duration=0.02)


def test_scenario_as_data():
    reference = {"kind": "setpoint", "position": [1] * 6}
    run = ut.simulate_scenario({"controller": "pid", "reference": reference, "loop": {"duration": 0.02}})
    assert run.status == 0 and run.metrics["steady"]["position_max"] <= run.metrics["whole"]["position_max"]
    assert run.dataset["axis"].attrs["controller_axes"] == "surge, sway, heave, roll, pitch, yaw"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"duration": -1.0}, "`duration` must be greater than 0, but is -1.0"),
        ({"loop": "both"}, "`loop` must be 'sampled' or 'continuous', but is 'both'"),
        ({"position": [1, 2]}, "`position` must have 6 entries (north, east, down, roll, pitch, yaw), but is 2 long"),
        (
            {"record": 1.5e-3},
            "`record` must be a whole number of steps of `loop.dt` (0.001 s), but is 0.0015 s. Take 0.001 or 0.002 s",
        ),
        (
            {"disturbance": ut.disturbances.wrench([1.0])},
            "`disturbance.value` must have 6 entries (surge, sway, heave, roll, pitch, yaw), but is of shape (1,)",
        ),
        ({"navigation": 3}, "`navigation` must be an AbstractNavigation, but is a int"),
    ],
)
def test_bad_argument_is_one_line(parts, options, said):
    with pytest.raises(ut.BadInput) as caught:
        ut.simulate(*parts, **options)
    assert named(str(caught.value)) == named(said)


def test_parts_that_are_none_are_told_what_is_meant(parts):
    vehicle, reference = ut.vehicles.odin(), parts[2]
    with pytest.raises(ut.BadInput, match=r"Give it thrusters: `ut\.HybridVehicle\(vehicle, ut\.thrusters"):
        ut.simulate(vehicle, "pid", reference)
    for arguments in (("odin", ut.thrusters.t200()), (vehicle, "t200")):
        with pytest.raises(ut.BadInput, match=r"must be a part, such as `ut\..*`, but is a str"):
            ut.HybridVehicle(*arguments)


def test_public_names():
    for name in dir(ut):
        assert getattr(ut, name) is not None
    assert ut.rcaf is ut.controllers.rcaf
    with pytest.raises(AttributeError, match="undertow has no `simulat`"):
        _ = ut.simulat


def test_samples(tmp_path):
    (tmp_path / "d.csv").write_text("t,d1\n0,1\n2,3\n")
    assert ut.read_samples(tmp_path / "d.csv") == [[0.0, 1.0], [2.0, 3.0]]


def test_a_metric_without_its_window():
    run = ut.simulate_scenario({"plant": "double_integrator", "reference": {"kind": "setpoint", "position": [1]}})
    assert run.metrics["steady"]["position_rms"] == run.metrics.get("steady")["position_rms"]
    assert run.metrics.get("position_rms") is None
    with pytest.raises(ut.BadInput, match=r'Write run\.metrics\["steady"\]\["position_rms"\]'):
        run.metrics["position_rms"]
