"""Judged runs: counts inside the loop, never-events, the same bytes in any company; controls that must fail."""

import math

import numpy as np
import pytest

from soak import controls, faults_soak, hours_soak
from soak.controls import CONTROLS, run_controls
from soak.counters import Counts
from soak.judged_runs import Judged, judge, judged_runs
from undertow.core.status import Status

pytestmark = pytest.mark.soak

AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 2.0},
    "controller": {"kind": "pid", "frequency": 1.0},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "navigation": {"kind": "white_noise", "velocity": 0.01},
    "loop": {"duration": 4.0, "dt": 0.01, "record": 0.1},
}


def test_counts_are_those_of_the_recorded_run():
    """Windows of a run against its record at every step, and limits against the saturation that the plant reports."""
    from undertow.run import simulate_scenario

    scenario = AXIS | {"initial": {"position": [1.5]}, "seed": 3}
    judged = judged_runs([scenario], windows=4)[0]
    whole = simulate_scenario(scenario | {"loop": AXIS["loop"] | {"record": 0.01}})
    error = whole.dataset["error"].values[:-1, 0]  # the end of the run decides nothing any more
    expected = np.sqrt((error.reshape(4, 100) ** 2).mean(1))
    np.testing.assert_allclose(judged.rms()[:, 0], expected, rtol=1e-9)
    assert judged.events() == [] and judged.status is Status.OK and judged.counts.steps == 400
    assert judged.counts.samples.tolist() == [100.0] * 4


def test_bytes_of_a_run_do_not_depend_on_its_company():
    several = [AXIS | {"seed": seed} for seed in range(9)]
    found = judged_runs(several, workers=2)
    assert len({one.digest for one in found}) == 9
    assert judged_runs([several[4]])[0].digest == found[4].digest
    assert [one.digest for one in judged_runs(several[::-2])] == [one.digest for one in found[::-2]]


def counts(**changes):
    zero = np.zeros(())
    found = Counts(np.asarray(10.0), zero, zero, zero, np.full(1, 10.0), np.ones((1, 2)), np.zeros(1))
    return found._replace(**{name: np.asarray(value) for name, value in changes.items()})


@pytest.mark.parametrize(
    ("events", "change"),
    [
        ([], {}),
        (["N1"], {"counts": counts(undefined_inputs=1.0)}),
        (["N1"], {"counts": counts(exceeded_limits=2.0)}),
        (["N4"], {"counts": counts(undefined_outputs=1.0)}),
        (["N4"], {"finite": False}),
        (["N4"], {"counts": counts(steps=9.0)}),
        ([], {"finite": False, "status": Status.NOT_FINITE}),
    ],
)
def test_never_events_of_a_run(events, change):
    one = Judged(Status.OK, "", (), 0, 1.0, counts(), True, 10, "", "simd")._replace(**change)
    assert [event for event, _ in one.events()] == events


def test_controls_fail_as_they_must_and_succeed_without_the_cause():
    found = run_controls(short=True)
    assert [row["identity"] for row in found.rows] == ["D5", "D8", "D9", "D10"] and found.failures == []
    assert "N1: an input that is not finite" in found.rows[0]["found"]  # 0/0, which the harness sees
    assert found.rows[3]["found"].startswith("refused")


@pytest.mark.slow
def test_all_ten_controls_fail():
    found = run_controls()
    assert [row["identity"] for row in found.rows] == [f"D{number}" for number in range(1, 11)] and found.failures == []


def test_a_control_that_does_not_fail_is_a_failure(monkeypatch):
    """A harness that sees no failures is found out."""
    harmless = CONTROLS[7]._replace(failing=CONTROLS[7].beside)
    monkeypatch.setattr(controls, "CONTROLS", (harmless,))
    found = run_controls()
    assert [one.identity for one in found.failures] == ["controls/D8"]


def test_a_long_run_is_judged_by_its_last_hour():
    squares = np.array([[3600.0], [3600.0], [3600.0 * 1.2]])
    grown = Counts(*[np.zeros(())] * 4, np.full(3, 3600.0), squares, np.array([1.0, 1.0, 1.2]))
    one = Judged(Status.OK, "", (), 0, 10800.0, grown._replace(steps=np.asarray(10.0)), True, 10, "", "simd")
    says = [failure.says for failure in hours_soak.judged_run(one, "hours/0/24/1", whole_day=True)]
    assert len(says) == 2 and "rms of the last hour 1.095 m" in says[0] and "weights grew to 1.2" in says[1]
    assert math.isclose(math.sqrt(1.2), 1.095, rel_tol=1e-3)
    assert hours_soak.judged_run(one, "hours/0/1/1", whole_day=False) == []


def test_a_faulted_run_has_the_bytes_of_its_scenario():
    """The numbers of faults that are written into a program are those that its scenario gives: the run says so itself."""
    several = faults_soak.programs()
    assert sum(len(one.kinds) for one in several) > 180
    place = next(k for k, one in enumerate(several) if one.kinds[0].target == "bus")
    program = several[place]
    runs = [faults_soak.Sampled(place, program.sample(np.random.default_rng(seed)), seed) for seed in range(3)]
    together = judge(faults_soak.runs_with_faults(program, runs))
    alone = judged_runs([program.scenario(run.faults, run.seed) for run in runs])
    assert [one.digest for one in together] == [one.digest for one in alone]
    assert len({one.digest for one in together}) == 3
    assert all(one.events() == [] for one in together)
