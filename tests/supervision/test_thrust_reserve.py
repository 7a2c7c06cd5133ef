"""The largest forces and moments of thrusters, against closed forms, and the reserve of a reference."""

import numpy as np
import pytest

import undertow as ut
from undertow.analysis.thrust_reserve import attainable_wrench, controlled_axes, reference_reserve
from undertow.core.errors import BadInput

pytestmark = pytest.mark.full

LOW, HIGH = -40.0, 50.0  # N
ODIN = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.t200())
HEAVE, ROLL, PITCH, YAW = 2, 3, 4, 5


def test_four_equal_vertical_thrusters_and_one_of_them_lost():
    whole = attainable_wrench(ODIN.thruster_matrix, LOW, HIGH)
    np.testing.assert_allclose(whole.alone[HEAVE], [-4 * HIGH, -4 * LOW], rtol=1e-9)  # a positive thrust lifts
    np.testing.assert_allclose(whole.free[HEAVE], whole.alone[HEAVE], rtol=1e-9)
    # Without roll and pitch the lost one's opposite has to stop, too: a pair on a diagonal is left.
    without = attainable_wrench(ODIN.thruster_matrix, LOW, HIGH, lost=[4])
    np.testing.assert_allclose(without.alone[HEAVE], [-2 * HIGH, -2 * LOW], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(without.free[HEAVE], [-3 * HIGH, -3 * LOW], rtol=1e-9)


def test_what_is_held_alone_is_within_what_is_attained_freely_and_a_loss_takes_from_both():
    before = attainable_wrench(ODIN.thruster_matrix, LOW, HIGH)
    for lost in range(8):
        after = attainable_wrench(ODIN.thruster_matrix, LOW, HIGH, lost=[lost])
        for one in (before, after):
            assert (one.alone[:, 1] <= one.free[:, 1] + 1e-9).all() and (one.alone[:, 0] >= one.free[:, 0] - 1e-9).all()
        assert (after.free[:, 1] <= before.free[:, 1] + 1e-9).all()
        assert (after.alone[:, 1] <= before.alone[:, 1] + 1e-9).all()


def test_axes_that_are_left():
    matrix = ut.vehicles.bluerov2().thruster_matrix()
    assert controlled_axes(matrix) == (0, 1, 2, 3, 5)
    assert controlled_axes(matrix, [4]) == (0, 1, 2, 5)
    assert controlled_axes(ODIN.thruster_matrix, [0]) == (0, 1, 2, 3, 4, 5)
    assert np.isnan(attainable_wrench(matrix, LOW, HIGH).alone[PITCH]).all()


def test_a_reference_needs_the_drag_of_the_current_and_a_loss_takes_the_reserve():
    model, hold = ODIN.model(), ut.references.setpoint([0.0] * 6, start=[0.0] * 6)
    reserve = lambda speed, lost=(): reference_reserve(model, hold, 10.0, (speed, 0.0, 0.0), lost, samples=5)
    assert reserve(1.0).feasible and not reserve(4.0).feasible
    # Drag is quadratic in surge alone: at twice the speed a quarter of the reserve.
    assert reserve(2.0).share == pytest.approx(reserve(1.0).share / 4, rel=0.05)
    assert reserve(1.0, [0]).share < 0.7 * reserve(1.0).share
    pair = reserve(0.1, [4, 5, 6])
    assert pair.missing and not pair.feasible


@pytest.mark.parametrize("speed", [0.5, 1.0, 1.6, 2.5, 4.0])
def test_a_reserve_beyond_enough_is_not_searched_for(speed):
    model, hold = ODIN.model(), ut.references.setpoint([0.0] * 6, start=[0.0] * 6)
    reserve = lambda **options: reference_reserve(model, hold, 10.0, (speed, 0.0, 0.0), samples=5, **options)
    assert reserve(enough=1.05).share == pytest.approx(min(reserve().share, 1.05), rel=1e-9)


def test_errors_say_what_is_possible():
    with pytest.raises(BadInput, match="`lost` must have numbers from 0 to 7, one per actuator, but is 8"):
        attainable_wrench(ODIN.thruster_matrix, LOW, HIGH, lost=[8])
    with pytest.raises(BadInput, match="must have 0 between them"):
        attainable_wrench(ODIN.thruster_matrix, 1.0, HIGH)
