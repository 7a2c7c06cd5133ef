"""Channels of an autopilot: each motor of a frame of ArduSub is the thruster that pushes like it."""

import numpy as np
import pytest

import undertow as ut
from undertow.core.errors import BadInput
from undertow.outside.thruster_channels import (
    FRAMES,
    Channels,
    channels_from_text,
    channels_of_frame,
    channels_of_vehicle,
)

pytestmark = pytest.mark.interop

# What the pilot asks of ArduSub, in the order of its factors, and the row and sign of the wrench that must follow:
# up is against heave, which is down.
DEMANDS = {
    "roll": (0, 3, 1),
    "pitch": (1, 4, 1),
    "yaw": (2, 5, 1),
    "up": (3, 2, -1),
    "forward": (4, 0, 1),
    "right": (5, 1, 1),
}
VEHICLES = [
    ("vectored_6dof", ut.vehicles.bluerov2_heavy, "vonbenzon2022"),
    ("vectored_6dof", ut.vehicles.bluerov2_heavy, "wu2018"),
    ("vectored_6dof", ut.vehicles.bluerov2_heavy, "ardusub_gazebo"),
    ("vectored", ut.vehicles.bluerov2, "hkpolyu"),
    ("vectored", ut.vehicles.bluerov2, "ignition"),
]


def matrix(vehicle, layout):
    return np.asarray(vehicle(layout=layout).thruster_matrix())


@pytest.mark.parametrize("frame, vehicle, layout", VEHICLES)
def test_what_ardusub_asks_for_is_what_the_thrusters_do(frame, vehicle, layout):
    """ArduSub mixes a demand into pulses by its factors. Through our channels and geometry its axis responds."""
    layout = matrix(vehicle, layout)
    channels = channels_of_frame(frame, layout)
    motors = np.array(FRAMES[frame], dtype=float)
    for name, (factor, row, sign) in DEMANDS.items():
        if not motors[:, factor].any():
            continue  # `vectored` has no pitch
        pwm = np.full(16, 1500.0)
        pwm[: len(motors)] += 400 * motors[:, factor]
        thrust = (channels.of_thrusters(pwm, 1500.0) - 1500) / 400
        wrench = layout @ thrust
        assert sign * wrench[row] > 0, name
        forces = np.abs(wrench[:3])
        assert row > 2 or forces[row] == pytest.approx(forces.sum()), name
        moments = np.abs(wrench[3:])
        assert row < 3 or moments[row - 3] > 0.99 * moments.max(), name
        assert row < 3 or forces.sum() < 1e-9, name


def test_the_layout_with_ardusubs_order_and_signs_needs_no_change():
    assert (
        str(channels_of_frame("vectored_6dof", matrix(ut.vehicles.bluerov2_heavy, "ardusub_gazebo")))
        == "1,2,3,4,5,6,7,8"
    )


def test_any_order_of_thrusters_is_recognised():
    """Columns in another order, some of them reversed: the channels follow."""
    chance = np.random.default_rng(3)
    original = matrix(ut.vehicles.bluerov2_heavy, "ardusub_gazebo")
    for _ in range(20):
        order, signs = chance.permutation(8), chance.choice([-1, 1], 8)
        found = channels_of_frame("vectored_6dof", original[:, order] * signs)
        np.testing.assert_array_equal(found.numbers, order + 1)
        np.testing.assert_array_equal(found.signs, signs)


def test_there_and_back():
    channels = channels_from_text("3,-1,7", 3)
    outputs = channels.of_outputs([1600.0, 1700.0, 1400.0], 1500.0)
    assert outputs == {3: 1600.0, 1: 1300.0, 7: 1400.0}
    pwm = np.zeros(16)
    for number, pulse in outputs.items():
        pwm[number - 1] = pulse
    np.testing.assert_array_equal(channels.of_thrusters(pwm, 1500.0), [1600.0, 1700.0, 1400.0])
    assert str(channels) == "3,-1,7"


@pytest.mark.parametrize(
    "text, said",
    [
        ("1,2", "`channels` must have 3 entries"),
        ("1,two,3", "`channels` must be whole numbers with commas"),
        ("", "`channels` must be whole numbers with commas"),
        ("1,2,0", "`channels` must be from 1 to 32"),
        ("1,2,33", "`channels` must be from 1 to 32"),
        ("1,2,-2", "`channels` must be different"),
    ],
)
def test_wrong_lists(text, said):
    with pytest.raises(BadInput, match=said):
        channels_from_text(text, 3)


def test_wrong_frames():
    heavy = matrix(ut.vehicles.bluerov2_heavy, "vonbenzon2022")
    with pytest.raises(BadInput, match="`frame` must be one of vectored_6dof, vectored"):
        channels_of_vehicle(heavy, "bluerov1")
    with pytest.raises(BadInput, match="`frame` must have the thrusters of the vehicle"):
        channels_of_vehicle(heavy, "vectored")
    with pytest.raises(BadInput, match="`frame` must be left out with `channels`"):
        channels_of_vehicle(heavy, "vectored_6dof", "1,2,3,4,5,6,7,8")
    with pytest.raises(BadInput, match="`channels` must be given for 3 thrusters"):
        channels_of_vehicle(heavy[:, :3])
    with pytest.raises(BadInput, match="`frame` must have the thrusters of the vehicle"):
        channels_of_vehicle(heavy[:, [0, 0, 2, 3, 4, 5, 6, 7]])  # two thrusters at one place


def test_a_channel_that_does_not_arrive():
    with pytest.raises(BadInput, match="`channels` must be of the 16 that arrive"):
        Channels(np.array([17]), np.array([1])).of_thrusters([1500] * 16, 1500.0)
