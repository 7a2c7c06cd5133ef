"""I8: turning and shifting the world, renaming thrusters and changing units change nothing but names."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import rcaf
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import Load
from undertow.core.numerics.integrators import rk4
from undertow.physics.disturbances import u1
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import paper_table3
from undertow.physics.vehicles import odin
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.sampled import simulate

pytestmark = pytest.mark.full

POSE = jnp.array([1.0, -2.0, 3.0, 0.2, -0.3, 0.5])
VELOCITY = jnp.array([0.3, -0.2, 0.1, 0.1, 0.2, -0.1])
STILL = np.eye(3)
ORDER = (3, 8, 1, 5, 7, 2, 6, 4)  # thrusters, from 1


def volts(t):
    return 8 * jnp.sin(jnp.arange(1.0, 9.0) * t + jnp.arange(8.0))


def push(t):
    """Lumped acceleration, earth frame, and wrench, body frame."""
    return Load(jnp.sin(t + jnp.arange(6.0)), 20 * jnp.cos(2 * t + jnp.arange(6.0)))


@eqx.filter_jit
def compiled(plant, start, world, length, voltage):
    """States over 5 s; `world` turns the earth-frame load, `length` and `voltage` are a metre and a volt."""
    force = jnp.concatenate([jnp.ones(3), jnp.full(3, length)]) * length
    stretch = jnp.concatenate([jnp.full(3, length), jnp.ones(3)])

    def field(t, x):
        d = push(t)
        acceleration = jnp.concatenate([world @ d.acceleration[:3], d.acceleration[3:]])
        return plant.dynamics(t, x, voltage * volts(t), Load(stretch * acceleration, force * d.wrench))

    def step(x, k):
        x = rk4(field, k * 1e-3, x, jnp.asarray(1e-3))
        return x, x

    return jax.lax.scan(step, start, jnp.arange(5000.0))[1]


def trajectory(plant, start, world=STILL, length=1.0, voltage=1.0):
    """Under prescribed voltages and loads, at steps of 1 ms.

    A step of 5 ms would not do: between its stages a quaternion is not quite of unit length, and the matrix made
    from it turns with the world only up to the error of the integrator (1.4e-10 at 5 ms).
    """
    return jax.tree.map(
        np.asarray, compiled(plant, start, jnp.asarray(world), jnp.asarray(length), jnp.asarray(voltage))
    )


def test_turning_the_world_about_the_vertical_and_shifting_it_maps_trajectories():
    plant = hybrid_vehicle(odin(), paper_table3("electromechanical"))
    turn, shift = 1.1, np.array([5.0, -7.0, 11.0])
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    moved = jnp.concatenate([about @ POSE[:3] + shift, POSE[3:] + np.array([0, 0, turn])])
    rates = jnp.concatenate([about @ VELOCITY[:3], VELOCITY[3:]])
    here = trajectory(plant, plant.initial_state(POSE, VELOCITY))
    there = trajectory(plant, plant.initial_state(moved, rates), about)
    assert np.ptp(np.asarray(here.position), axis=0).min() > 0.5
    np.testing.assert_allclose(there.position, here.position @ about.T + shift, rtol=0, atol=1e-10)
    np.testing.assert_allclose(there.nu, here.nu, rtol=0, atol=1e-10)
    np.testing.assert_allclose(there.thrusters.speed, here.thrusters.speed, rtol=0, atol=1e-10)
    c, s = np.cos(turn / 2), np.sin(turn / 2)
    w, x, y, z = np.asarray(here.attitude).T
    product = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], axis=1)  # the turn, then q
    np.testing.assert_allclose(there.attitude, product, rtol=0, atol=1e-10)


def in_centimetres(plant):
    """Same vehicle and motor in centimetres, kilograms, seconds, amperes: newtons grow by 100, volts by 10^4."""
    length, area = 100.0, 1e4
    force_rows = np.array([1.0, 1, 1, length, length, length])
    vehicle, motor = plant.vehicle, plant.thruster.motor
    mass_like = np.outer(force_rows, force_rows)  # kg, kg m, kg m^2
    quadratic_like = np.outer(force_rows, [1 / length] * 3 + [length] * 3)  # N s^2/m^2 ... N m s^2
    vehicle = eqx.tree_at(
        lambda v: (
            *(v.weight, v.buoyancy, v.r_g, v.r_b, v.inertia, v.added_mass),
            *(v.linear_damping, v.quadratic_damping, v.thruster_positions),
        ),
        vehicle,
        (
            *(length * vehicle.weight, length * vehicle.buoyancy, length * vehicle.r_g, length * vehicle.r_b),
            *(area * vehicle.inertia, mass_like * vehicle.added_mass, mass_like * vehicle.linear_damping),
            *(quadratic_like * vehicle.quadratic_damping, length * vehicle.thruster_positions),
        ),
    )
    electrical = ("resistance", "inductance", "torque_constant", "back_emf_constant")
    mechanical = ("friction", "rotor_inertia", "torque_coefficient", "reverse_torque_coefficient")
    scaled = {name: area * getattr(motor, name) for name in electrical + mechanical}
    for name in ("thrust_coefficient", "reverse_thrust_coefficient"):
        scaled[name] = length * getattr(motor, name)
    motor = eqx.tree_at(lambda m: [getattr(m, name) for name in scaled], motor, list(scaled.values()))
    return hybrid_vehicle(vehicle, eqx.tree_at(lambda t: t.motor, plant.thruster, motor))


def test_centimetres_give_the_same_motion_as_metres():
    plant = hybrid_vehicle(odin(), paper_table3("electromechanical"))
    small = in_centimetres(plant)
    scale = np.array([100.0, 100, 100, 1, 1, 1])
    metres = trajectory(plant, plant.initial_state(POSE, VELOCITY))
    centimetres = trajectory(small, small.initial_state(scale * POSE, scale * VELOCITY), length=100.0, voltage=1e4)
    np.testing.assert_allclose(centimetres.position / 100, metres.position, rtol=0, atol=1e-10)
    np.testing.assert_allclose(centimetres.nu / scale, metres.nu, rtol=0, atol=1e-10)
    np.testing.assert_allclose(centimetres.attitude, metres.attitude, rtol=0, atol=1e-10)
    np.testing.assert_allclose(centimetres.thrusters.speed, metres.thrusters.speed, rtol=0, atol=1e-9)
    np.testing.assert_allclose(centimetres.thrusters.current, metres.thrusters.current, rtol=0, atol=1e-9)


def closed_loop(vehicle):
    plant = hybrid_vehicle(vehicle, paper_table3("ideal"))
    goal = setpoint(np.array([2, 3, 4, np.pi / 3, np.pi / 4, 2 * np.pi / 5]))
    return ClosedLoop(plant, rcaf(plant.model(), preset="paper"), goal, u1(), perfect())


def test_renaming_the_thrusters_renames_the_voltages_and_nothing_else():
    """In closed loop with the paper's law, gains and disturbances."""
    named = simulate(closed_loop(odin().with_thrusters(range(1, 9))), duration=2.0)
    renamed = simulate(closed_loop(odin().with_thrusters(ORDER)), duration=2.0)
    volts = np.asarray(named.signals["input"])
    assert np.abs(volts).max() > 10
    np.testing.assert_allclose(renamed.signals["position"], named.signals["position"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        renamed.signals["input"], volts[:, np.array(ORDER) - 1], rtol=0, atol=1e-11 * np.abs(volts).max()
    )
