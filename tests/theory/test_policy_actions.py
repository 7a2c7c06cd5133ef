"""What an action of a policy stands for: a wrench needs thrusters with limits and body axes."""

import numpy as np
import pytest

import undertow as ut
from undertow.control.controllers.policy_interface import policy_interface_of
from undertow.core.errors import BadInput


def model(supply):
    return ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.linear_voltage(supply=supply)).model()


def test_a_wrench_needs_thrusters_with_limits():
    with pytest.raises(BadInput) as error:
        policy_interface_of(model(np.inf), "wrench")
    assert error.value.name == "action" and "supply" in error.value.hint
    assert policy_interface_of(model(20.0), "wrench").of_wrench is not None


def test_a_wrench_needs_body_axes():
    with pytest.raises(BadInput) as error:
        policy_interface_of(ut.plants.double_integrator(2, 1.0).model(), "wrench")
    assert error.value.name == "action"


def test_a_wrench_is_a_share_of_the_largest_acceleration_within_the_limits():
    """A small action accelerates along its own axis alone; no action asks a thruster for more than its limit."""
    plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.linear_voltage(supply=20.0))
    interface = policy_interface_of(plant.model(), "wrench")
    low, high = interface.action_bounds()
    np.testing.assert_array_equal(low, -np.ones(6))
    np.testing.assert_array_equal(high, np.ones(6))
    np.testing.assert_array_equal(interface.within_bounds(np.array([-2, 2, 0.5, 0, 0, 0.0])), [-1, 1, 0.5, 0, 0, 0])
    b_alpha = np.asarray(plant.thruster_matrix) * np.asarray(plant.thruster.voltage_gain())
    effect = np.linalg.solve(np.asarray(plant.body.mass_matrix), b_alpha)
    largest = 20.0 * np.abs(effect).sum(1)
    accelerations = effect @ np.asarray([interface.command(action) for action in 0.1 * np.eye(6)]).T
    np.testing.assert_allclose(accelerations, np.diag(0.1 * largest), atol=1e-9 * largest.max())
    assert np.abs(interface.command(np.ones(6))).max() == pytest.approx(20.0)
