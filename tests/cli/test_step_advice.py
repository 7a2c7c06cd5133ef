"""Steps that are too long for the winding of a motor are named before the run, with the number of sub-steps that do."""

import pytest

from undertow.scenario.schema import Loop
from undertow.scenario.stepping import fastest_decay, step_advice
from undertow.thrusters import first_order, linear_voltage, t200

SCENARIO = """
plant: {{vehicle: odin, thruster: {{kind: t200, rung: electromechanical}}, ledger: false}}
reference: {{kind: setpoint, position: [0, 0, 0, 0, 0, 0]}}
disturbance: {{kind: wrench, value: [5, 0, 0, 0, 0, 0]}}
loop: {{dt: 0.01, duration: 0.5, substeps: {substeps}}}
"""


def test_decay_of_the_winding_is_that_of_its_time_constant():
    motor = t200(rung="electromechanical").motor
    assert fastest_decay(t200(rung="electromechanical")) == pytest.approx(
        float(motor.resistance / motor.inductance), rel=0.01
    )
    assert fastest_decay(first_order(time_constant=0.2)) == pytest.approx(5.0)
    assert fastest_decay(linear_voltage()) == 0.0


def test_advice_says_how_many_substeps_are_enough():
    said = step_advice(t200(rung="electromechanical"), Loop(dt=0.01))
    assert len(said) == 1 and "Take loop.substeps: 9 or more" in said[0]
    assert not step_advice(t200(rung="electromechanical"), Loop(dt=0.01, substeps=9))
    assert not step_advice(t200(), Loop(dt=0.01))
    assert not step_advice(t200(rung="electromechanical"), Loop(kind="continuous", dt=0.01, method="adaptive"))
    assert "a shorter loop.dt" in step_advice(t200(rung="electromechanical"), Loop(kind="continuous", dt=0.01))[0]


@pytest.mark.parametrize(("substeps", "code"), [(8, 1), (9, 0)])
def test_the_number_is_right(undertow, tmp_path, substeps, code):
    (tmp_path / "s.yaml").write_text(SCENARIO.format(substeps=substeps))
    said = undertow("simulate", "s.yaml")
    assert said.code == code, said
    assert ("steps of 1.25 ms are unstable beyond 1.2" in said.err) == bool(code)
