"""A model without some of its actuators: the nearest acceleration, the axes that give way, commands of zero."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core.measurement import measurement_of_outputs
from undertow.supervision.reduced_model import attained_share, default_priority, least_forces, reduced

VEHICLES = {"odin": ut.vehicles.odin, "heavy": ut.vehicles.bluerov2_heavy, "bluerov2": ut.vehicles.bluerov2}


OTHERS = [(name, euler) for name in VEHICLES for euler in (True, False) if (name, euler) != ("odin", False)]


def model_of(name, euler=False):
    model = ut.HybridVehicle(VEHICLES[name](), ut.thrusters.t200()).model()
    return model if euler else model.in_body_axes()


def used_without(count, *lost):
    return jnp.ones(count).at[jnp.asarray(lost, dtype=int)].set(0.0)


def measured():
    return measurement_of_outputs(jnp.asarray([0.0, 0.0, 1.0, 0.1, -0.2, 0.7]), 0.1 * jnp.ones(6))


@pytest.mark.parametrize(
    ("name", "euler"), [("odin", False), *(pytest.param(name, euler, marks=pytest.mark.full) for name, euler in OTHERS)]
)
def test_with_every_actuator_it_is_the_model_itself(name, euler):
    model, demand = model_of(name, euler), jnp.asarray([0.3, -0.2, 0.1, 0.4, 0.0, -0.3])
    y, count = measured(), model.dynamics.gain(measured()).shape[1]
    whole = reduced(model, jnp.ones(count), default_priority(model))
    same = model.dynamics.invert(y, demand)
    np.testing.assert_allclose(whole.dynamics.invert(y, demand), same, rtol=1e-12, atol=1e-12)
    assert (whole.dynamics.gain(y) == model.dynamics.gain(y)).all()
    forces = jnp.linspace(-3.0, 3.0, count)
    state, rate = model.actuators.init(), jnp.asarray(10.0)
    assert (whole.actuators.command(state, forces, rate) == model.actuators.command(state, forces, rate)).all()


@pytest.mark.parametrize("name", ["odin", pytest.param("heavy", marks=pytest.mark.full)])
def test_one_of_eight_lost_leaves_every_acceleration_with_the_smallest_forces(name):
    model, demand = model_of(name), jnp.asarray([0.3, -0.2, 0.1, 0.4, 0.2, -0.3])
    gain, priority = np.asarray(model.dynamics.gain(measured())), default_priority(model)
    forces_of = jax.jit(lambda used: reduced(model, used, priority).dynamics.invert(measured(), demand))
    for lost in range(8):
        used = np.where(np.arange(8) == lost, 0.0, 1.0)
        forces = forces_of(used)
        assert forces[lost] == 0.0
        exact = np.linalg.pinv(gain * used) @ np.asarray(demand)
        np.testing.assert_allclose(forces, exact, rtol=0, atol=1e-4 * np.abs(exact).max(), err_msg=f"without {lost}")


@pytest.mark.full
def test_bluerov2_without_a_vertical_thruster_keeps_heave_and_gives_up_roll():
    model = model_of("bluerov2")
    gain, priority = model.dynamics.gain(measured()), default_priority(model)
    before, after = (attained_share(gain, used, priority) for used in (used_without(6), used_without(6, 5)))
    np.testing.assert_allclose(before[jnp.asarray([0, 1, 2, 3, 5])], 1.0, atol=0.05)
    np.testing.assert_allclose(after[jnp.asarray([0, 1, 2, 5])], 1.0, atol=0.05)
    assert after[3] < 0.2


def test_the_attained_share_is_what_the_least_forces_give():
    model, used = model_of("odin"), used_without(8, 0, 2)
    gain, priority = model.dynamics.gain(measured()), default_priority(model)
    given = [gain[axis] @ least_forces(gain, used, priority, jnp.eye(6)[axis]) for axis in range(6)]
    np.testing.assert_allclose(attained_share(gain, used, priority), given, atol=1e-6)


def test_lost_actuators_get_no_command_and_have_no_range():
    model, used = model_of("heavy"), used_without(8, 3)
    actuators = reduced(model, used, default_priority(model)).actuators
    state, rate = actuators.init(), jnp.asarray(10.0)
    command = actuators.command(state, 5.0 * jnp.ones(8), rate)
    low, high = actuators.range(state, rate)
    assert command[3] == low[3] == high[3] == 0.0
    kept = np.delete(np.arange(8), 3)
    assert (np.asarray(command)[kept] > 0).all() and (np.asarray(low)[kept] < 0).all()
    assert actuators.quasi_static().command((), 5.0 * jnp.ones(8), rate)[3] == 0.0
