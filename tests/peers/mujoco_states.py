"""Vehicles in both worlds, and states to compare them at."""

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import Load, Water
from undertow.core.numerics.integrators import rk4
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import paper_table3


def poses(count, seed):
    """Positions within 5 m and attitudes up to 80 degrees of pitch; velocities within 1 m/s and 1 rad/s."""
    chance = np.random.default_rng(seed)
    highest = np.array([5, 5, 5, np.pi, 1.4, np.pi])
    return chance.uniform(-highest, highest, (count, 6)), chance.uniform(-1, 1, (count, 6)), chance


def undertow_acceleration(vehicle):
    """Function of (eta, nu, thrust, velocity of the water, its acceleration): nu_dot of undertow's plant."""
    plant = hybrid_vehicle(vehicle, paper_table3("shaft"))

    def evaluate(eta, nu, thrust, velocity, acceleration):
        x = plant.initial_state(eta)._replace(nu=nu)
        x = x._replace(thrusters=x.thrusters._replace(speed=plant.thruster.motor.speed_at(thrust)))
        load = Load(jnp.zeros(6), jnp.zeros(6), Water(velocity, acceleration))
        return plant.dynamics(jnp.zeros(()), x, jnp.zeros(plant.inputs()), load).nu

    return jax.jit(evaluate)


def undertow_motion(vehicle, eta, nu, duration, dt):
    """Position and nu of undertow's plant, left to itself, after `duration`."""
    plant = hybrid_vehicle(vehicle, paper_table3("shaft"))
    start = plant.initial_state(jnp.asarray(eta))._replace(nu=jnp.asarray(nu))
    rest = jnp.zeros(plant.inputs())
    field = lambda t, x: plant.dynamics(t, x, rest, plant.no_load())
    step = lambda k, x: rk4(field, jnp.zeros(()), x, jnp.asarray(dt))
    x = jax.jit(lambda x: jax.lax.fori_loop(0, round(duration / dt), step, x))(start)
    return np.asarray(x.position), np.asarray(x.nu)
