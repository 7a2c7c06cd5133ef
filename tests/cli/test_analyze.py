"""`undertow analyze`: a page and a table of predictions, and what simulate makes of them."""

import json

import pytest

from undertow.cli.main import run

pytestmark = pytest.mark.full

ROBUST = """\
plant: {kind: double_integrator, axes: 2, limit: 8}
controller: {kind: rcaf, preset: robust, bandwidth: 30}
reference: {kind: setpoint, position: [0, 0]}
disturbance: {kind: sinusoid, amplitude: [1, 2], frequency: [3, 7]}
loop: {duration: 8}
"""
# The paper's law with motors that lag: section 3.9.
LAGGING = """\
plant:
  vehicle: odin
  thruster: {kind: first_order, thrust_per_volt: 20, time_constant: 0.1, supply: 24}
  ledger: false
controller: paper
reference: {kind: setpoint, position: [0, 0, 0, 0, 0, 0]}
disturbance: {kind: sinusoid, amplitude: 2, frequency: 1}
loop: {duration: 1, dt: 0.002}
"""


def test_predictions_are_written_and_shown(undertow, whole_figures, tmp_path):
    (tmp_path / "s.yaml").write_text(ROBUST)
    said = undertow("analyze", "s.yaml", "--out", "out", "--details")
    assert said.code == 0, said.err
    found = json.loads((tmp_path / "out" / "prediction.json").read_text())
    assert [row["frequency"] for row in found["estimators"]] == [30.0, 30.0]
    assert found["estimators"][0]["ramp_error"] == pytest.approx(2 / 30)
    assert [point["held"] for point in found["points"]] == [True] * 3
    assert all(point["spectral_radius"] < 1 for point in found["points"])
    assert found["actuator_authority"]["high"] == [8.0, 8.0] and found["actuator_authority"]["held"] == 1.0
    assert found["actuator_authority"]["demand"] == pytest.approx([1.0, 2.0], rel=1e-3)
    poles = [complex(*row["expected"]) for row in found["closed_forms"]]
    assert poles == pytest.approx([-30.0, -15.0], rel=1e-6)
    page = (tmp_path / "out" / "prediction.html").read_text()
    assert page.count("<img") == 3 and "undefined" not in page and "nan" not in page.lower().replace("nano", "")
    for title in (
        "Controllable closed-loop poles over the operating range",
        "Error per unit of disturbance",
        "Actuator authority",
    ):
        assert title in said.out and title in page
    assert {path.name for path in (tmp_path / "out" / "figures").iterdir()} >= {"poles.png", "frequency.svg"}


@pytest.mark.slow
def test_what_is_doubtful_is_advised(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(LAGGING)
    said = undertow("analyze", "s.yaml", "--out", "out")
    assert said.code == 0
    assert "Advice: the loop is unstable at 4 of 4 operating points: rightmost pole +" in said.err
    assert "Advice: the weights are not bounded" in said.err
    assert "No errors are predicted: the loop linearised at fixed weights is unstable" in said.out
    margins = json.loads((tmp_path / "out" / "prediction.json").read_text())["margins"]
    assert margins == {"sampling_time": 0.0, "delay": 0.0, "lag": 0.0, "gain_low": 1.0, "gain_high": 1.0}


def test_a_run_is_put_beside_its_prediction(undertow, tmp_path):
    (tmp_path / "s.yaml").write_text(ROBUST)
    said = undertow("simulate", "--prediction", "s.yaml", "--out", "out")
    assert said.code == 0 and "The run agrees with the prediction: no metric departs by more than 10 %." in said.out, (
        said.out
    )
    found = json.loads((tmp_path / "out" / "metrics.json").read_text())
    for name in ("position_rms", "position_estimation_rms", "input_rms"):
        assert found["predicted"][name] == pytest.approx(found["steady"][name], rel=0.1)


def test_a_saturated_run_has_no_prediction_and_says_why_on_request(undertow, monkeypatch, capsys, tmp_path):
    """Nothing is linearised for it."""
    monkeypatch.setattr("undertow.cli.run_presentation.operating_point", None)
    (tmp_path / "s.yaml").write_text(ROBUST.replace("limit: 8", "limit: 1.7"))
    said = undertow("simulate", "--prediction", "s.yaml", "--out", "out")
    assert (
        "No prediction: actuators were saturated 46 % of the time, which the linear model does not capture.\n"
        in said.out
    )
    assert run(["simulate", "s.yaml", "--out", "quiet"]) == 0
    assert "rediction" not in capsys.readouterr().out
    found = json.loads((tmp_path / "quiet" / "metrics.json").read_text())
    assert found["predicted"] is None and found["not_predicted"].startswith("actuators were saturated")


def test_mistakes_are_those_of_a_scenario(refused, tmp_path):
    (tmp_path / "s.yaml").write_text(ROBUST.replace("bandwidth: 30", "bandwidth: -30"))
    assert refused("analyze", "s.yaml") == (
        "`controller.bandwidth` must be positive, but is -30 rad/s (s.yaml, line 2)"
    )
    assert refused("analyze", "none.yaml") == "`none.yaml` must be an existing file, but is not. Files there: s.yaml"


def test_a_loop_without_finite_slopes_is_refused(refused, tmp_path):
    """Where numbers are so large that their products are not finite."""
    text = "plant: two_link_arm\nreference: {kind: sine, amplitude: [1, 1], frequency: 1e154}\nloop: {duration: 0.04"
    (tmp_path / "s.yaml").write_text(f"{text}, dt: 0.01, record: 0.01}}\n")
    said = "The loop cannot be linearised: its slopes are not finite"
    assert refused("analyze", "s.yaml").startswith(said)
