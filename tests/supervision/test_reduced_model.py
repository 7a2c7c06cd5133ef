"""A model without some of its actuators: the nearest acceleration, the axes that give way, commands of zero."""

import equinox as eqx
import jax
import numpy as np
import pytest

import undertow as ut
from undertow.control.supervision.reduced_model import attained_share, default_priority, least_forces, reduced
from undertow.core.measurement import measurement_of_outputs
from undertow.physics.plants.double_integrator import double_integrator

VEHICLES = {"odin": ut.vehicles.odin, "heavy": ut.vehicles.bluerov2_heavy, "bluerov2": ut.vehicles.bluerov2}


OTHERS = [(name, euler) for name in VEHICLES for euler in (True, False) if (name, euler) != ("odin", False)]


def model_of(name, euler=False):
    model = ut.HybridVehicle(VEHICLES[name](), ut.thrusters.t200()).model()
    return model if euler else model.in_body_axes()


def used_without(count, *lost):
    return np.where(np.isin(np.arange(count), lost), 0.0, 1.0)


def measured():
    return measurement_of_outputs(np.array([0.0, 0.0, 1.0, 0.1, -0.2, 0.7]), 0.1 * np.ones(6))


shares = jax.jit(attained_share)


@eqx.filter_jit
def gain_of(model):
    return model.dynamics.gain(measured())


@eqx.filter_jit
def answers(model, demand, forces):
    """Forces that a model finds for an acceleration, its gain, and its command for forces."""
    actuators, y = model.actuators, measured()
    return (
        model.dynamics.invert(y, demand),
        model.dynamics.gain(y),
        actuators.command(actuators.init(), forces, np.asarray(10.0)),
    )


@pytest.mark.parametrize(
    ("name", "euler"), [("odin", False), *(pytest.param(name, euler, marks=pytest.mark.full) for name, euler in OTHERS)]
)
def test_with_every_actuator_it_is_the_model_itself(name, euler):
    model, demand = model_of(name, euler), np.array([0.3, -0.2, 0.1, 0.4, 0.0, -0.3])
    count = gain_of(model).shape[1]
    forces, whole = np.linspace(-3.0, 3.0, count), reduced(model, np.ones(count), default_priority(model))
    found, expected = (answers(each, demand, forces) for each in (whole, model))
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(found[1], expected[1])
    np.testing.assert_array_equal(found[2], expected[2])


@pytest.mark.parametrize("name", ["odin", pytest.param("heavy", marks=pytest.mark.full)])
def test_one_of_eight_lost_leaves_every_acceleration_with_the_smallest_forces(name):
    model, demand = model_of(name), np.array([0.3, -0.2, 0.1, 0.4, 0.2, -0.3])
    gain, priority = np.asarray(gain_of(model)), default_priority(model)
    forces_of = jax.jit(lambda used: reduced(model, used, priority).dynamics.invert(measured(), demand))
    for lost in range(8):
        used = used_without(8, lost)
        forces = np.asarray(forces_of(used))
        assert forces[lost] == 0.0
        exact = np.linalg.pinv(gain * used) @ demand
        np.testing.assert_allclose(forces, exact, rtol=0, atol=1e-4 * np.abs(exact).max(), err_msg=f"without {lost}")


@pytest.mark.full
def test_bluerov2_without_a_vertical_thruster_keeps_heave_and_gives_up_roll():
    model = model_of("bluerov2")
    gain, priority = gain_of(model), default_priority(model)
    before, after = (np.asarray(shares(gain, used, priority)) for used in (used_without(6), used_without(6, 5)))
    np.testing.assert_allclose(before[[0, 1, 2, 3, 5]], 1.0, atol=0.05)
    np.testing.assert_allclose(after[[0, 1, 2, 5]], 1.0, atol=0.05)
    assert after[3] < 0.2


def test_the_attained_share_is_what_the_least_forces_give():
    model, used = model_of("odin"), used_without(8, 0, 2)
    gain, priority = gain_of(model), default_priority(model)
    forces = jax.jit(jax.vmap(lambda demand: least_forces(gain, used, priority, demand)))(np.eye(6))
    given = np.diag(np.asarray(gain) @ np.asarray(forces).T)
    np.testing.assert_allclose(shares(gain, used, priority), given, atol=1e-6)


def test_lost_actuators_get_no_command_and_have_no_range():
    model, used, forces = model_of("heavy"), used_without(8, 3), 5.0 * np.ones(8)
    actuators = reduced(model, used, default_priority(model)).actuators

    @jax.jit
    def answers(rate):
        state, quasi_static = actuators.init(), actuators.quasi_static()
        command, (low, high) = actuators.command(state, forces, rate), actuators.range(state, rate)
        return command, low, high, quasi_static.command((), forces, rate)

    command, low, high, of_quasi_static = map(np.asarray, answers(10.0))
    assert command[3] == low[3] == high[3] == 0.0
    kept = np.delete(np.arange(8), 3)
    assert (command[kept] > 0).all() and (low[kept] < 0).all()
    assert of_quasi_static[3] == 0.0


def test_axes_of_a_vehicle_give_way_in_their_order_and_others_alike():
    np.testing.assert_array_equal(default_priority(double_integrator(3).model()), [1.0, 1.0, 1.0])
    np.testing.assert_array_equal(default_priority(model_of("heavy")), [1, 1, 1, 0.1, 0.1, 0.3])
