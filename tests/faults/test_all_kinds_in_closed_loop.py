"""Every kind of fault in a closed loop: it alters the run after its onset, and nothing before it."""

import numpy as np
import pytest

from undertow.core import runtime
from undertow.physics.faults.kinds import list_kinds
from undertow.scenario.build import build
from undertow.simulation.loop.loop_runs import RunPlan
from undertow.simulation.prepared_run import prepare_loop
from undertow.simulation.run_many import run_together

pytestmark = pytest.mark.slow

ONSET, DURATION, DT = 0.5, 1.2, 0.01
NEVER = 1e9

SENSORS = ["imu", "dvl", "depth", "compass", "position_fix", "propeller_speed"]
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "fidelity": "shaft", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "sine", "amplitude": [0.3, 0.2, 0.2, 0.1, 0.1, 0.3], "frequency": 1.5},
    "loop": {"duration": DURATION, "dt": DT, "record": DT},
}
# A law that uses the report of the propellers: only with a motor model is there anything to learn from it.
MOTORS = {
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "shaft"}},
    "model": {"speed_sensor": True},
}
# So often that every fault of this short run falls on some reading.
OFTEN = ["imu", {"kind": "dvl", "period": DT}, "depth", "compass", {"kind": "position_fix", "period": DT, "delay": 0.0}]
# The observer is quicker to compile; the Kalman filter also takes the speeds of the propellers.
OBSERVER = {"controller": "pid", "navigation": {"kind": "observer", "sensors": OFTEN}}
KALMAN = MOTORS | {"navigation": {"kind": "kalman", "sensors": SENSORS}}


def surroundings(kind):
    """What a run needs so that this target exists and is used."""
    if kind.target.endswith("propeller_speed"):
        return KALMAN if kind.target.startswith("sensor") else MOTORS
    return OBSERVER if kind.target.startswith("sensor") else {}


# Inputs of this run are small: severities that are shares of the largest input have to be near the end of their range.
SEVERITIES = {("bus", "sag"): 0.99}


def entry_of(kind, onset):
    target = "thruster 2" if kind.target == "thruster" else kind.target
    severity = SEVERITIES.get((kind.target, kind.mode))
    return {"target": target, "mode": kind.mode, "onset": onset} | ({} if severity is None else {"severity": severity})


def both(kind):
    """Recorded signals of a run with the fault and of one in which it never begins; one compiled program."""
    data = SCENARIO | surroundings(kind)
    loops = [build(data | {"faults": [entry_of(kind, onset)]}).closed_loop for onset in (ONSET, NEVER)]
    with runtime.in_precision("float64"):
        plan = RunPlan(round(DURATION / DT), DT, 1, tuple(loops[0].signals()))
        outcome = run_together([prepare_loop(loop, plan, 3) for loop in loops])
    assert outcome.status[1] == 0, "the run without the fault does not last"
    return {name: np.asarray(one) for name, one in outcome.signals.items()}, np.asarray(outcome.time[0])


@pytest.mark.parametrize("kind", list_kinds(), ids=lambda kind: f"{kind.target}-{kind.mode}".replace(" ", "_"))
def test_every_kind_alters_the_run_after_its_onset_only(kind):
    signals, time = both(kind)
    before, after = time < ONSET - DT / 2, time > ONSET + DT / 2
    assert before.sum() == 50 and after.sum() >= 60
    position = signals["position"]
    assert (signals["active_faults"][0] == (time > ONSET - DT / 2)).mean() > 0.1 and not signals["active_faults"][
        1
    ].any()
    for name, one in signals.items():
        assert np.array_equal(one[0][before], one[1][before], equal_nan=True), name
    assert not np.array_equal(position[0][after], position[1][after], equal_nan=True)
