"""Two vehicles with a link: internal forces cancel, the link gives no energy, and without it each moves alone."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import Load
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import rk4
from undertow.core.numerics.rotations import Kinematics, rotation_from_quaternion
from undertow.core.status import Status
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.plants.link import Place, SpringDamper
from undertow.physics.plants.two_vehicles import two_vehicles
from undertow.physics.thrusters.first_order import first_order
from undertow.physics.thrusters.linear_voltage import linear_voltage
from undertow.physics.vehicles.bluerov2 import bluerov2
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy

APART = jnp.asarray([0.3, -0.4, 1.0, 0.2, -0.3, 0.8, -5.0, 1.5, 0.4, -0.4, 0.2, -1.0])
MOVING = jnp.asarray([0.5, 0.1, -0.2, 0.3, -0.1, 0.2, -0.3, 0.4, 0.1, -0.2, 0.4, 0.1])
POINTS = {"first_point": (-0.2, 0.05, 0.1), "second_point": (0.25, -0.1, 0.05)}


def pair(thruster=None, **options):
    thruster = thruster or linear_voltage()
    return two_vehicles(bluerov2_heavy(), thruster, second_vehicle=bluerov2(), **(POINTS | options))


def random_places(seed):
    rng = np.random.default_rng(seed)
    place = lambda: Place(rng.normal(size=3), _rotation(_unit(rng.normal(size=4))), rng.normal(size=6))
    return place(), place()


_rotation = jax.jit(rotation_from_quaternion)


def _unit(q):
    return q / np.linalg.norm(q)


@jax.jit
def forces(link, first, second):
    return link.forces(first, second)


@pytest.mark.parametrize("kind", ["tether", "bar"])
@pytest.mark.parametrize("seed", range(4))
def test_internal_forces_cancel(kind, seed):
    """Forces are equal and opposite, and so are moments about any fixed point of the world."""
    first, second = random_places(seed)
    found = forces(SpringDamper(**POINTS, length=0.2, stiffness=70.0, damping=5.0, kind=kind), first, second)
    assert abs(float(found.tension)) > 1.0
    about = np.asarray([0.4, -2.0, 3.0])
    force, moment = np.zeros(3), np.zeros(3)
    for body, wrench in ((first, found.first), (second, found.second)):
        own, turn = (np.asarray(body.rotation) @ half for half in np.split(np.asarray(wrench), 2))
        force, moment = force + own, moment + turn + np.cross(body.position - about, own)
    np.testing.assert_allclose(force, 0, atol=1e-12)
    np.testing.assert_allclose(moment, 0, atol=1e-12)


@pytest.mark.parametrize("kind", ["tether", "bar", "none"])
def test_power_of_the_link_is_loss_and_stored_energy(kind):
    """nu . wrench of both bodies = -(d energy / dt + loss), and the loss is never negative, whatever the motion."""
    link = SpringDamper(**POINTS, length=1.5, stiffness=70.0, damping=15.0, kind=kind)

    @jax.jit
    def evaluate(first, second):
        found = link.forces(first, second)
        stored = jax.jvp(link.energy, (found.extension,), (found.rate,))[1]
        return found, stored, link.loss(found)

    signs = set()
    for seed in range(40):
        first, second = random_places(seed)
        found, stored, loss = jax.tree.map(np.asarray, evaluate(first, second))
        power = first.nu @ found.first + second.nu @ found.second
        assert power == pytest.approx(-(stored + loss), abs=1e-9)
        assert loss >= 0
        signs.add((float(found.extension) > 0, float(found.rate) > 0))
    assert len(signs) == 4  # stretched and slack, opening and closing


def test_tension_of_a_tether_and_a_bar():
    """k x + c x_dot along a line; a tether neither pushes nor pulls while slack, and gives no negative tension."""
    at = lambda distance, speed: (
        Place(np.zeros(3), np.eye(3), np.zeros(6)),
        Place(np.array([distance, 0.0, 0.0]), np.eye(3), np.array([speed, 0, 0, 0, 0, 0])),
    )
    still = {"first_point": (0, 0, 0), "second_point": (0, 0, 0), "length": 2.0, "stiffness": 100.0, "damping": 8.0}
    tension = lambda kind, distance, speed: float(
        forces(SpringDamper(**still, kind=kind), *at(distance, speed)).tension
    )
    assert tension("tether", 2.3, 0.5) == pytest.approx(34.0)
    assert tension("tether", 2.1, -2.0) == 0.0
    assert tension("tether", 1.9, 3.0) == 0.0
    assert tension("bar", 1.9, 0.25) == pytest.approx(-8.0)
    assert tension("none", 2.3, 0.5) == 0.0


@pytest.mark.full
@pytest.mark.parametrize("kind", ["tether", "bar"])
def test_energy_balance_along_a_motion(kind):
    """Without thrust: kinetic energy and energy of the link fall by the loss of drag and link; weight and buoyancy work.

    Integrated beside the motion: to the accuracy of the integrator.
    """
    # Thrusters with a state: without one, J_dot nu would count as a prescribed load.
    plant = pair(link=kind, length=4.5, stiffness=80.0, damping=10.0, thruster=first_order())
    still, u = plant.no_load(), jnp.zeros(plant.inputs())

    def powers(x):
        total = plant.link.loss(plant.link_forces(x))
        for one, state in ((plant.first, x.first), (plant.second, x.second)):
            down = rotation_from_quaternion(state.attitude)[2]
            total = total + (state.nu * (one.body.damping(state.nu) + one.body.restoring(down))).sum()
        return total

    def energy(x):
        found = plant.link.energy(plant.link_forces(x).extension)
        for one, state in ((plant.first, x.first), (plant.second, x.second)):
            found = found + state.nu @ one.body.mass_matrix @ state.nu / 2
        return found

    def step(carry, k):
        x, spent = carry
        rates = lambda t, both: (plant.dynamics(t, both[0], u, still), powers(both[0]))
        carry = rk4(rates, k * 0.002, (x, spent), 0.002)
        return carry, energy(carry[0]) + carry[1]

    @jax.jit
    def move(x):
        (final, spent), total = jax.lax.scan(step, (x, jnp.zeros(())), jnp.arange(1500.0))
        return energy(x), spent, total, plant.status(final)

    begun, spent, total, status = map(np.asarray, move(plant.initial_state(APART, 2 * MOVING)))
    assert spent > 0.2 * begun
    np.testing.assert_allclose(total, begun, rtol=0, atol=1e-4 * begun)
    assert status == int(Status.OK)


@eqx.filter_jit
def acceleration(plant, x, u, load):
    return plant.acceleration(0.0, x, u, load)


def test_without_a_link_each_vehicle_moves_alone():
    plant, hulls = pair(link="none"), (bluerov2_heavy(), bluerov2())
    u = np.arange(float(plant.inputs())) / 3 - 1
    load = Load(np.arange(12.0) / 10, np.arange(12.0)[::-1] / 7)
    alone = [hybrid_vehicle(hull, linear_voltage(), ledger=False) for hull in hulls]
    places = slice(6), slice(6, 12)

    @jax.jit
    def all_of(u, load):
        found, expected = plant.acceleration(0.0, plant.initial_state(APART, MOVING), u, load), []
        for one, own, volts in zip(alone, places, (u[:8], u[8:]), strict=True):
            state = one.initial_state(APART[own], MOVING[own])
            expected.append(one.acceleration(0.0, state, volts, jax.tree.map(lambda leaf, own=own: leaf[own], load)))
        return found, expected

    found, expected = all_of(u, load)
    for own, one in zip(places, expected, strict=True):
        np.testing.assert_allclose(found[own], one, atol=1e-12)


@pytest.mark.full
def test_model_has_a_block_for_each_vehicle_and_no_link():
    """F + G u is x_ddot of the plant without a link; with one, the rest is M^-1 of its wrench on each vehicle."""
    u = jnp.linspace(-2, 2, pair().inputs())
    for kind in ("none", "tether"):
        plant = pair(link=kind, length=4.5)
        x, dynamics = plant.initial_state(APART, MOVING), plant.model().dynamics

        @jax.jit
        def evaluate(x, plant=plant, dynamics=dynamics):
            y, found = plant.output(0.0, x), plant.link_forces(x)
            bodies = [(plant.first, x.first, found.first), (plant.second, x.second, found.second)]
            pulled = [
                Kinematics(rotation_from_quaternion(state.attitude)).to_world(one.body.accelerate(wrench))
                for one, state, wrench in bodies
            ]
            known = dynamics.drift(y) + dynamics.gain(y) @ u
            return dynamics.gain(y), known + jnp.concatenate(pulled), found.tension

        gain, expected, tension = map(np.asarray, evaluate(x))
        assert not gain[:6, 8:].any() and not gain[6:, :8].any()
        np.testing.assert_allclose(acceleration(plant, x, u, plant.no_load()), expected, atol=1e-10)
        assert (tension > 10) == (kind == "tether")


def test_bad_options():
    for options, name in (({"link": "chain"}, "link"), ({"length": 0.0}, "length"), ({"damping": -1.0}, "damping")):
        with pytest.raises(BadInput, match=name):
            pair(**options)
