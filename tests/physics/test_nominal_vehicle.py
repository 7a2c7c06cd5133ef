"""A controller with the nominal model of another vehicle, whatever the true one is."""

import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core.measurement import measurement_of_outputs

Y = measurement_of_outputs(jnp.array([1.0, 2.0, 3.0, 0.3, -0.2, 0.5]), jnp.array([0.4, -0.3, 0.2, 0.1, -0.2, 0.3]))


def heavy(parameters):
    return ut.HybridVehicle(ut.vehicles.bluerov2_heavy(parameters), ut.thrusters.t200())


@pytest.mark.full
def test_model_of_another_parameter_set():
    given = heavy("ng2024").model(vehicle=ut.vehicles.bluerov2_heavy("vonbenzon2022"), rate_term=True)
    own = heavy("vonbenzon2022").model(rate_term=True)
    demand = jnp.linspace(-1.0, 1.0, 6)
    assert np.array_equal(given.dynamics.drift(Y), own.dynamics.drift(Y))
    assert np.array_equal(given.dynamics.gain(Y), own.dynamics.gain(Y))
    assert np.array_equal(given.dynamics.invert(Y, demand), own.dynamics.invert(Y, demand))
    assert np.abs(given.dynamics.drift(Y) - heavy("ng2024").model(rate_term=True).dynamics.drift(Y)).max() > 0.1


def test_vehicle_with_other_thrusters_is_refused():
    with pytest.raises(ut.BadInput, match="`vehicle` must have 8 thrusters, as the true one has, but is 6"):
        heavy("ng2024").model(vehicle=ut.vehicles.bluerov2())


@pytest.mark.full
def test_in_a_scenario():
    run = ut.simulate_scenario(
        {
            "plant": {"vehicle": {"kind": "bluerov2_heavy", "parameters": "ng2024"}, "thruster": "linear_voltage"},
            "model": {"vehicle": {"kind": "bluerov2_heavy", "mass": 10.0}},
            "reference": {"kind": "setpoint", "position": [0.1, 0, 0, 0, 0, 0]},
            "loop": {"duration": 0.1},
        }
    )
    assert run.status == 0
    assert "mass: 10.0" in run.dataset.attrs["scenario"]
