"""An identification that was interrupted goes on where it was, and has the bits of one that was not."""

import math

import numpy as np
import pytest

import undertow as ut
from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.checkpoint import Checkpoint
from undertow.studies.identification.identify import identify
from undertow.studies.identification.result_data import as_data
from undertow.studies.identification.simulated_dive import telegraph_dive

pytestmark = pytest.mark.full

SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "reference": {"kind": "setpoint", "position": [0] * 6},
    "loop": {"dt": 0.01, "duration": 1},
}


def test_it_has_the_bits_of_one_without_an_interruption(tmp_path):
    with in_precision("float64"):
        log = telegraph_dive(hybrid_vehicle(bluerov2_heavy(), t200()), {"quadratic_damping.surge": 100.0}, 1, 20.0)
    built, begun = build(from_data(SCENARIO)), []

    def identified(name, resume, say=lambda stage: None):
        checkpoint = Checkpoint(tmp_path / name, "a dive", math.inf, resume, what="identification")
        return identify(built, [log], free=("quadratic_damping",), checkpoint=checkpoint, say=say)

    def stop_in_the_third(stage):
        begun.append(stage)
        if stage.startswith("estimate 3 of 5"):
            raise KeyboardInterrupt

    whole = identified("whole.jsonl", False)
    with pytest.raises(KeyboardInterrupt):
        identified("stopped.jsonl", False, stop_in_the_third)
    assert begun[-1].startswith("estimate 3 of 5 (without simulated dive, part 2 of 4), about ")
    repeated = []
    resumed = identified("stopped.jsonl", True, repeated.append)
    assert not any(stage.startswith(("estimate 1", "estimate 2")) for stage in repeated)
    assert as_data(resumed) == as_data(whole)
    np.testing.assert_array_equal(resumed.estimate.residuals, whole.estimate.residuals)
    with pytest.raises(ut.BadInput, match="continue with the same scenario"):
        Checkpoint(tmp_path / "stopped.jsonl", "another dive", math.inf, True, what="identification")
