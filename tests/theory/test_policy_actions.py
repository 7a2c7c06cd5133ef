"""What an action of a policy stands for: a wrench needs thrusters with limits and body axes."""

import numpy as np
import pytest

import undertow as ut
from undertow.controllers.policy_interface import policy_interface_of
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
