"""Steps that are too long for the winding of a motor are named before the run, with the number of sub-steps that do."""

import math

import numpy as np
import pytest

import undertow as ut
from undertow.core.status import Status
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters import first_order, linear_voltage, t200
from undertow.physics.vehicles import bluerov2, bluerov2_heavy
from undertow.scenario.build import build
from undertow.scenario.consistency import rounded_times
from undertow.scenario.results.run_scenario import run_scenario
from undertow.scenario.schema import ClosedLoopSettings
from undertow.scenario.step_size import fastest_decay, step_advice

SCENARIO = """
plant: {{vehicle: odin, thruster: {{kind: t200, fidelity: electromechanical}}, ledger: false}}
controller: {{kind: pid, frequency: 1}}
reference: {{kind: setpoint, position: [0, 0, 0, 0, 0, 0]}}
disturbance: {{kind: wrench, value: [5, 0, 0, 0, 0, 0]}}
loop: {{dt: 0.01, duration: 0.5, substeps: {substeps}}}
"""


def test_decay_of_the_winding_is_that_of_its_time_constant():
    motor = t200(fidelity="electromechanical").motor
    assert fastest_decay(t200(fidelity="electromechanical")) == pytest.approx(
        float(motor.resistance / motor.inductance), rel=0.01
    )
    assert fastest_decay(first_order(time_constant=0.2)) == pytest.approx(5.0)
    assert fastest_decay(linear_voltage()) == 0.0


def test_advice_says_how_many_substeps_are_enough():
    plant = lambda **options: hybrid_vehicle(bluerov2_heavy(), t200(**options))
    winding = plant(fidelity="electromechanical")
    said = step_advice(winding, ClosedLoopSettings(dt=0.01))
    assert len(said) == 1 and "Use loop.substeps: 9 or more" in said[0].hint
    assert not step_advice(winding, ClosedLoopSettings(dt=0.01, substeps=9))
    assert not step_advice(plant(), ClosedLoopSettings(dt=0.01))
    assert not step_advice(winding, ClosedLoopSettings(kind="continuous", dt=0.01, method="adaptive"))
    assert "a loop.dt of at most" in step_advice(winding, ClosedLoopSettings(kind="continuous", dt=0.01))[0].hint


def test_advice_where_the_damping_of_the_hull_is_too_fast():
    """Roll of BlueROV2 in set hkpolyu: 25 N m s/rad over the inertia with added mass; rk4 is stable up to 2.785."""
    plant = hybrid_vehicle(bluerov2(parameters="hkpolyu"), t200())
    damping, mass = plant.body.linear_damping[3, 3], plant.body.mass_matrix[3, 3]
    enough = int(np.ceil(0.05 * float(damping / mass) / 2.785))
    assert enough > 1
    (said,) = step_advice(plant, ClosedLoopSettings(dt=0.05))
    assert "the hull has, by its damping," in said.says and f"loop.substeps: {enough} or more" in said.hint
    assert not step_advice(plant, ClosedLoopSettings(dt=0.05, substeps=enough))


@pytest.mark.slow
@pytest.mark.parametrize(("substeps", "code"), [(8, 1), (9, 0)])
def test_the_number_is_right(undertow, tmp_path, substeps, code):
    (tmp_path / "s.yaml").write_text(SCENARIO.format(substeps=substeps))
    said = undertow("simulate", "s.yaml")
    assert said.code == code, said
    assert ("but the step is 1.25 ms: the run will diverge numerically" in said.err) == bool(code)


def plant_of(decay):
    return {"kind": "linear_plant", "gain": [[1.0]], "velocity_term": [[-decay]]}


BASE = {
    "plant": plant_of(1000.0),
    "controller": {"kind": "pid", "frequency": 1.0, "feedforward": False},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "initial": {"velocity": [0.5]},
    "loop": {"duration": 5.0, "dt": 0.01},
}


@pytest.mark.full
@pytest.mark.parametrize("method", ["rk4", pytest.param("euler", marks=pytest.mark.slow)])
def test_a_plant_too_stiff_for_its_steps_is_not_called_an_unstable_loop(method):
    """x_ddot = -1000 x_dot + u at 10 ms: 2.785 (2 for Euler's method) over 1000 / s, in so many substeps, and no fewer."""
    failed = run_scenario(BASE | {"loop": BASE["loop"] | {"method": method}})
    said = failed.dataset.attrs["status_sentence"]
    assert failed.status is not Status.OK and "the loop is unstable" not in said.replace("because the loop is", "")
    enough = math.ceil(0.01 * 1000 / {"rk4": 2.785, "euler": 2.0}[method])
    assert (
        f"steps of {method} above" in said
        and "but the step is 10 ms" in said
        and f"loop.substeps: {enough} or more" in said
    )
    for substeps, status in ((enough - 1, False), (enough, True)):
        loop = BASE["loop"] | {"method": method, "substeps": substeps}
        assert (run_scenario(BASE | {"loop": loop}).status is Status.OK) == status


@pytest.mark.full
def test_an_unstable_loop_is_still_called_one():
    """A law of 100 rad/s at 10 ms: the plant is slow, and finer steps of it change nothing."""
    wild = BASE | {"plant": plant_of(1.0), "controller": {"kind": "pid", "frequency": 300.0}}
    for substeps in (1, 10):
        failed = run_scenario(wild | {"loop": BASE["loop"] | {"substeps": substeps, "duration": 20.0}})
        assert failed.status is Status.DIVERGED
        assert "the loop is unstable" in failed.dataset.attrs["status_sentence"]


@pytest.mark.slow
def test_a_law_too_stiff_for_one_ode():
    """Filter pole 150 / s of the identification model in steps of 50 ms: 7.5 beyond 2.785; with 10 ms it lasts."""
    scenario = {
        "plant": "double_integrator",
        "controller": {"kind": "paper", "composite": 0.0},
        "reference": {"kind": "setpoint", "position": [1.0]},
        "disturbance": {"kind": "sinusoid"},
    }
    loop = {"kind": "continuous", "duration": 20.0, "record": 0.1}
    failed = run_scenario(scenario | {"loop": loop | {"dt": 0.05}})
    assert failed.status is not Status.OK
    assert "plant and controller have a time constant of" in failed.dataset.attrs["status_sentence"]
    assert run_scenario(scenario | {"loop": loop | {"dt": 0.01}}).status is Status.OK


@pytest.mark.full
@pytest.mark.parametrize(
    ("loop", "said"),
    [
        ({"duration": 1.005, "dt": 0.005, "record": 0.02}, ["the last record is at 1 s, 0.005 s before the end"]),
        (
            {"duration": 1.005, "dt": 0.01, "record": 0.01},
            ["the run lasts 1 s, a whole number of steps of 0.01 s, not 1.005 s"],
        ),
        ({"duration": 0.3, "dt": 0.1, "record": 0.1}, []),
        ({"duration": 100.1, "dt": 1e-3, "record": 0.1}, []),
        (
            {"kind": "continuous", "duration": 0.29, "record": 0.1},
            ["the last record is at 0.2 s, 0.09 s before the end"],
        ),
        (
            {"kind": "continuous", "method": "adaptive", "duration": 0.29, "record": 0.1},
            ["the last record is at 0.2 s"],
        ),
    ],
)
def test_times_that_are_no_multiples_are_told(loop, said):
    """And what is said of them is what a run does."""
    given = rounded_times(ClosedLoopSettings(**loop))
    assert len(given) == len(said) and all(one.says.startswith(words) for one, words in zip(given, said, strict=True))
    if loop.get("kind") != "continuous":
        built = build(BASE | {"plant": plant_of(1.0), "loop": loop})
        assert set(given) <= set(built.advice())
        found = run_scenario(built)
        end = round(loop["duration"] / loop["dt"]) * loop["dt"]
        assert float(found.outcome.ended) == pytest.approx(end, rel=1e-12)
        left = end - float(found.dataset["time"][-1])
        assert (left > 1e-9) == any("last record" in one.says for one in given)


@pytest.mark.full
def test_python_warns_of_them_too():
    plant = ut.plants.double_integrator()
    law = ut.controllers.pid(plant.model(), sampling_time=0.01)
    with pytest.warns(UserWarning, match="the last record is at 0.1 s"):
        ut.simulate(plant, law, ut.references.setpoint([1.0]), duration=0.15, dt=0.01, record=0.1)


@pytest.mark.full
def test_single_precision_says_when_its_clock_stops():
    long = {"duration": 2e5, "dt": 0.01, "record": 1.0}
    said = build(BASE | {"plant": plant_of(1.0), "precision": "float32", "loop": long}).advice()
    assert any("float32 cannot distinguish instants beyond 16777216 steps, 167772 s" in one.says for one in said)
    assert not any("float32" in one.says for one in build(BASE | {"plant": plant_of(1.0), "loop": long}).advice())
