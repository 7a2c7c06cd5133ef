"""I5: the work that the thrusters do is all there, as motion, height or heat; without them energy only falls."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import kinetic_energy, potential_energy

from undertow.core.contracts import Load
from undertow.core.numerics.integrators import rk4
from undertow.core.numerics.rotations import rotation_from_quaternion
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import paper_table3
from undertow.physics.vehicles import odin

ODIN = hybrid_vehicle(odin(), paper_table3("shaft"))
START = jnp.array([[0.0, 0, 0, 0.5, -0.4, 1.0], [0.4, -0.3, 0.2, 0.3, -0.2, 0.5]])


class Ledger(NamedTuple):
    """State of the plant, the net work done on it so far, and all that went in or out, J."""

    x: Any
    work: Any
    throughput: Any


def energy(plant, x):
    down = rotation_from_quaternion(x.attitude)[2]
    return kinetic_energy(plant.body, x.nu) + potential_energy(plant.body, x.position, down)


def pushed(t):
    """tau(t), N and N m: every axis differently, enough to turn the vehicle over."""
    angles = jnp.array([0.7, 1.1, 1.7, 0.4, 0.9, 1.3]) * t + jnp.arange(6.0)
    return jnp.array([60.0, 50, 70, 60, 70, 40]) * jnp.sin(angles)


@eqx.filter_jit
def balance(plant, steps, strength):
    """Over 20 s: (gain of energy - net work) / throughput, throughput, energy lost and largest rise in one step, J."""
    dt = 20 / steps

    def field(t, state):
        tau = strength * pushed(t)
        nu, calm = state.x.nu, jnp.zeros(6)
        rates = plant.dynamics(t, state.x, jnp.zeros(8), Load(calm, -tau))
        supplied, lost = nu @ tau, nu @ plant.body.damping(nu)
        return Ledger(rates, supplied - lost, jnp.abs(supplied) + lost)

    def step(k, carry):
        state, rise = carry
        new = rk4(field, jnp.asarray(k, dtype=float) * dt, state, dt)
        return new, jnp.maximum(rise, energy(plant, new.x) - energy(plant, state.x))

    start = Ledger(plant.initial_state(*START), jnp.zeros(()), jnp.zeros(()))
    steps = jnp.asarray(steps, dtype=int)
    end, rise = jax.lax.fori_loop(0, steps, step, (start, jnp.asarray(-jnp.inf)))
    gained = energy(plant, end.x) - energy(plant, start.x)
    return (gained - end.work) / end.throughput, end.throughput, -gained, rise


def numbers(plant, steps, strength):
    return [float(value) for value in balance(plant, jnp.asarray(float(steps)), jnp.asarray(strength))]


@pytest.mark.full
def test_energy_balances_over_twenty_seconds():
    defect, throughput, _, _ = numbers(ODIN, 20_000, 1.0)
    assert throughput > 1000
    assert abs(defect) <= 1e-6


@pytest.mark.full
def test_error_of_the_balance_is_of_order_four():
    """Halving dt divides the defect by sixteen."""
    defects = np.abs([numbers(ODIN, n, 1.0)[0] for n in (800, 1600, 3200)])
    slopes = np.log2(defects[:-1] / defects[1:])
    assert ((slopes >= 3.8) & (slopes <= 4.2)).all(), (defects, slopes)


@pytest.mark.full
def test_energy_never_rises_without_thrust():
    _, _, lost, rise = numbers(ODIN, 20_000, 0.0)
    assert lost > 10
    assert rise <= 1e-12 * lost


def test_power_of_the_loads_is_the_rate_of_energy():
    """d(T + U)/dt = nu . (tau - D nu) at any instant, by automatic differentiation: thrusters at work, tumbling."""
    rng = np.random.default_rng(8)
    count = 300

    def rates(case):
        q, nu, speed, tau = case
        x = ODIN.initial_state()._replace(attitude=q / jnp.linalg.norm(q), nu=nu)
        x = x._replace(thrusters=x.thrusters._replace(speed=speed))
        rate = jax.jvp(
            lambda x: energy(ODIN, x), (x,), (ODIN.dynamics(jnp.zeros(()), x, speed, Load(jnp.zeros(6), -tau)),)
        )[1]
        thrust = ODIN.thruster_matrix @ ODIN.thruster.thrust(x.thrusters, speed)
        return rate, nu @ (tau + thrust - ODIN.body.damping(nu))

    draws = rng.normal(size=(count, 4)), rng.normal(size=(count, 6)), 20 * rng.normal(size=(count, 8))
    found, expected = jax.jit(lambda *cases: jax.lax.map(rates, cases))(*draws, 50 * rng.normal(size=(count, 6)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.full
def test_upright_is_where_potential_energy_is_least():
    """ODIN's centre of gravity hangs 5 cm below its centre of buoyancy: 61.3 N m/rad of righting moment."""
    body = ODIN.body

    def at(roll):
        return potential_energy(body, jnp.zeros(3), jnp.array([0.0, jnp.sin(roll), jnp.cos(roll)]))

    np.testing.assert_allclose(jax.grad(at)(0.0), 0.0, atol=1e-12)
    np.testing.assert_allclose(jax.grad(jax.grad(at))(0.0), 1226.0 * 0.05, rtol=1e-12)
    np.testing.assert_allclose(at(np.pi) - at(0.0), 2 * 1226.0 * 0.05, rtol=1e-12)
