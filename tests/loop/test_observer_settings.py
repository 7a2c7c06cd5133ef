"""The observer with constant gains: every blend is a share, above 0 and at most 1; and what it knows at the start."""

import numpy as np
import pytest

from undertow.control.navigation.observer import observer
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.sensors import compass, depth, dvl, imu, position_fix, propeller_speed
from undertow.physics.thrusters.thruster import PropellerReport

SENSORS = (imu, dvl, depth, compass, position_fix, propeller_speed)
BLENDS = ("imu", "dvl", "compass", "depth", "fix", "propeller")


@pytest.mark.parametrize("blend", [0.0, -0.1, 1.5])
@pytest.mark.parametrize("name", BLENDS)
def test_a_blend_that_is_no_share(name, blend):
    with pytest.raises(BadInput) as error:
        observer([sensor() for sensor in SENSORS], **{f"{name}_blend": blend})
    assert error.value.name == f"{name}_blend"


@pytest.mark.parametrize("name", BLENDS)
def test_a_blend_of_one_is_a_share(name):
    built = observer([sensor() for sensor in SENSORS], **{f"{name}_blend": 1.0})
    assert float(getattr(built.filter, f"{name}_blend")) == 1.0


def test_propeller_speeds_are_known_only_by_their_sensor():
    y = measurement_of_outputs(np.zeros(6), np.zeros(6), PropellerReport(np.arange(8.0), None))
    without = observer([imu(), dvl()]).filter.start(y)
    with_sensor = observer([imu(), dvl(), propeller_speed()]).filter.start(y)
    assert without.estimate.actuator is None
    np.testing.assert_array_equal(with_sensor.estimate.actuator.speed, np.arange(8.0))
