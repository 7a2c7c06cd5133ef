"""Records of a scenario that does not say how far apart they are."""

import pytest

import undertow as ut
from undertow.scenario.build import build

SCENARIO = {"plant": "double_integrator", "reference": {"kind": "setpoint", "position": [1]}}


@pytest.mark.parametrize(("dt", "record"), [(1e-3, 0.01), (2e-3, 0.01), (3e-3, 0.012), (0.02, 0.02), (0.5, 0.5)])
def test_records_are_whole_steps(dt, record):
    assert build(SCENARIO | {"loop": {"dt": dt}}).scenario.loop.record == pytest.approx(record, rel=1e-12)


def test_milliseconds_are_still_noticed():
    with pytest.raises(ut.BadInput, match=r"It is in seconds: 5 ms are 0\.005"):
        build(SCENARIO | {"loop": {"dt": 5}})
