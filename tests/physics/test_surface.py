"""The surface: closed forms of the cut hull, draught at rest, energy, and that the deep vehicle knows nothing of it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import kinetic_energy

from undertow.core.contracts import FreeSurface, Pose, Water
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import rk4
from undertow.core.numerics.rotations import rotation_from_quaternion
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.disturbances.surface import UnderSurface, stated_depths, surface
from undertow.physics.disturbances.waves import waves
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.physics.vehicles.body import SeenFromWater
from undertow.physics.vehicles.submersion import FRESH_WATER, dry_share

HEAVY = bluerov2_heavy("wu2018")  # 114.8 N of buoyancy, 112.8 N of weight
SIZE = np.array([0.457, 0.575, 0.254])
PLANT = hybrid_vehicle(HEAVY, t200(supply=16.0))
BOX = hybrid_vehicle(eqx.tree_at(lambda v: v.size, HEAVY, jnp.asarray(SIZE), is_leaf=lambda one: one is None), t200())
OFF, ZERO = jnp.zeros(8), jnp.zeros(())


def load_at(plant, depth):
    return plant.no_load()._replace(surface=FreeSurface(jnp.asarray(depth), ZERO))


def undamped(plant):
    return eqx.tree_at(lambda p: (p.body.linear_damping, p.body.quadratic_damping), plant, (0 * jnp.eye(6),) * 2)


@eqx.filter_jit
def carried_on(plant, x, load, dt, steps):
    """State after a number of steps without thrust."""
    field = lambda t, x: plant.dynamics(t, x, OFF, load)
    return jax.lax.fori_loop(0, steps, lambda k, x: rk4(field, ZERO, x, dt), x)


def cut_by_slices(half_size, x, down):
    """Share under water and centre of that part from the centre of an ellipsoid, by summing over thin slices.

    The unit sphere, whose map is the ellipsoid, is cut at -x along the image of `down`.
    """
    edges = np.linspace(-x, 1, 200_001)
    z = (edges[1:] + edges[:-1]) / 2
    areas = 3 / 4 * (1 - z**2) * np.diff(edges)  # of the volume
    axis = half_size * down / np.linalg.norm(half_size * down)
    return areas.sum(), half_size * axis * (areas * z).sum() / areas.sum()


@pytest.mark.parametrize("x", [-0.9, -0.3, 0.0, 0.5, 0.97])
def test_buoyancy_is_that_of_the_cut_ellipsoid(x):
    """Its size and its centre, at an attitude; against a sum over slices."""
    down = np.array([0.36, -0.48, 0.8])
    half, body = SIZE / 2, BOX.body
    height = np.sqrt(((half * down) ** 2).sum())
    position = jnp.array([0.0, 0.0, x * height - body.r_b @ down])
    cut = BOX.hull.cut(FreeSurface(ZERO, ZERO), position, jnp.asarray(down), body)
    still = SeenFromWater(jnp.zeros(6), jnp.asarray(down), ZERO)
    found = np.asarray(cut.wrench(still) - body.restoring(jnp.asarray(down)))
    share, centre = cut_by_slices(half, x, down)
    force = float(body.weight - share * body.buoyancy) * down
    lever = float(body.weight) * np.asarray(body.r_g) - share * float(body.buoyancy) * (np.asarray(body.r_b) + centre)
    np.testing.assert_allclose(found, [*force, *np.cross(lever, down)], rtol=0, atol=1e-6)
    assert 1 - cut.dry == pytest.approx(share, abs=1e-9)


def test_share_is_one_when_deep_and_zero_in_the_air():
    found = np.asarray(dry_share(jnp.array([-2.0, -1.0, 0.0, 1.0, 2.0])))
    np.testing.assert_array_equal(found, [1.0, 1.0, 0.5, 0.0, 0.0])


def test_without_a_size_it_is_the_sphere_of_the_displaced_water():
    radius = float(PLANT.hull.half_size[0])
    displaced = 114.8 / (112.8 / 11.5)  # kg
    assert FRESH_WATER * 4 / 3 * np.pi * radius**3 == pytest.approx(displaced, rel=1e-12)
    np.testing.assert_array_equal(BOX.hull.half_size, SIZE / 2)


@pytest.mark.full
@pytest.mark.parametrize("plant", [PLANT, BOX], ids=["sphere", "size"])
def test_it_floats_where_buoyancy_is_weight(plant):
    """s(x) = W / B, a cubic: x = 2 sin(arcsin(2 W / B - 1) / 3). From 2 m below, in still water."""
    weight, buoyancy = 112.8, 114.8
    x = 2 * np.sin(np.arcsin(2 * weight / buoyancy - 1) / 3)
    depth = x * float(plant.hull.half_size[2])  # of the centre of buoyancy, which is the origin
    start = plant.initial_state(jnp.array([0.0, 0, 1.0, 0.1, -0.1, 0.3]))
    end = carried_on(plant, start, load_at(plant, 1.0), jnp.asarray(0.01), 12_000)
    assert float(end.position[2]) + 1.0 == pytest.approx(depth, abs=1e-3)
    np.testing.assert_allclose(end.nu, 0, atol=2e-3)
    np.testing.assert_allclose(rotation_from_quaternion(end.attitude)[2], [0, 0, 1], atol=2e-3)


@pytest.mark.full
def test_a_heavy_vehicle_sinks():
    plant = hybrid_vehicle(bluerov2_heavy(), t200(supply=16.0))
    end = carried_on(plant, plant.initial_state(), load_at(plant, 0.0), jnp.asarray(0.01), 3000)
    assert float(end.position[2]) > 0.5


def test_in_the_air_only_weight_acts():
    """Free fall about the centre of gravity, whatever the thrusters and the water do."""
    x = PLANT.initial_state(jnp.array([0.0, 0, -1.0, 0, 0, 0]), jnp.array([0.3, 0, 0, 0, 0, 0]))
    load = load_at(PLANT, 0.0)._replace(water=Water(jnp.array([0.5, 0.2, 0.1]), jnp.zeros(3)))
    volts = jnp.full(8, 12.0)
    turning = PLANT.dynamics(ZERO, x, volts, load).thrusters
    spun = x._replace(thrusters=jax.tree.map(lambda leaf, rate: leaf + 0.1 * rate, x.thrusters, turning))
    found = PLANT.acceleration(ZERO, spun, volts, load)
    np.testing.assert_allclose(found, [0, 0, 112.8 / 11.5, 0, 0, 0], atol=1e-12)


def test_a_deep_vehicle_does_not_know_of_the_surface():
    """The same bits, at attitudes and speeds of any kind."""
    rates = jax.jit(lambda *given: BOX.dynamics(*given))
    for draw in np.random.default_rng(0).normal(size=(4, 2, 6)):
        x = BOX.initial_state(jnp.asarray(draw[0] * [3, 3, 0.3, 0.6, 0.6, 2]), jnp.asarray(draw[1]))
        found = [rates(ZERO, x, jnp.linspace(-9, 9, 8), load) for load in (BOX.no_load(), load_at(BOX, 3.0))]
        jax.tree.map(np.testing.assert_array_equal, *found)


@pytest.mark.full
def test_energy_is_kept_at_the_surface():
    """Without damping, of a body that tumbles through the surface: kinetic energy with the added mass of the submerged
    share, height of the weight, and work against buoyancy.
    """
    plant = undamped(BOX)
    body, hull = plant.body, plant.hull

    def energy(x):
        down = rotation_from_quaternion(x.attitude)[2]
        cut = hull.cut(FreeSurface(ZERO, ZERO), x.position, down, body)
        present = eqx.tree_at(lambda b: b.mass_matrix, body, body.mass_matrix - cut.dry * hull.added_mass)
        s = (8 * cut.x + 6 * cut.x**2 - cut.x**4 + 3) / 16  # integral of the share
        above = (x.position[2] + body.r_b @ down) / cut.half_height - cut.x  # 0 while the surface cuts it
        sunk = cut.half_height * (s + jnp.where(above > 0, above, 0.0))
        fallen = body.weight * (x.position[2] + body.r_g @ down)
        return kinetic_energy(present, x.nu) - fallen + body.buoyancy * sunk

    def step(x, _):
        dry = hull.cut(FreeSurface(ZERO, ZERO), x.position, rotation_from_quaternion(x.attitude)[2], body).dry
        return rk4(lambda t, x: plant.dynamics(t, x, OFF, load_at(plant, 0.0)), ZERO, x, 1e-3), (energy(x), dry)

    start = plant.initial_state(jnp.array([0.0, 0, -0.1, 0.5, -0.4, 1.0]), jnp.array([0.4, -0.3, 0.2, 0.9, -0.5, 0.5]))
    total, dry = jax.jit(lambda x: jax.lax.scan(step, x, length=2000)[1])(start)
    np.testing.assert_allclose(total, total[0], rtol=0, atol=2e-5)  # J; without the force of changing added mass, 7.7
    assert dry.min() < 0.01 and dry.max() > 0.8  # it went through the surface


@pytest.mark.full
def test_elevation_belongs_to_the_motion_of_the_water():
    """The surface moves with the water at it: the rate of the elevation is the upward velocity there."""
    sea = waves(height=1.0, depth=2.0, spreading=0.3)
    path = sea.realize(jax.random.PRNGKey(3))
    pose = Pose(jnp.array([1.5, -4.0, -2.0]), jnp.eye(3), jnp.zeros(3))
    at = jax.jit(lambda t: sea.at(path, t, pose, PLANT.no_load()))
    for t in (0.0, 3.0, 7.5):
        rate = (at(t + 1e-4).surface.elevation - at(t - 1e-4).surface.elevation) / 2e-4
        assert float(rate) == pytest.approx(-float(at(t).water.velocity[2]), abs=1e-6)
    assert float(at(0.0).surface.depth) == 2.0


@pytest.mark.full
def test_it_rides_on_long_waves():
    """0.4 m high, 9 s: a floating vehicle follows the surface."""
    sea = waves(height=0.4, period=9.0, depth=0.0)
    path = sea.realize(jax.random.PRNGKey(0))

    @eqx.filter_jit
    def ridden(x):
        field = lambda t, x: PLANT.dynamics(t, x, OFF, sea.at(path, t, PLANT.pose(x), PLANT.no_load()))

        def step(x, k):
            t = 0.01 * k
            height = sea.at(path, t, PLANT.pose(x), PLANT.no_load()).surface.elevation
            return rk4(field, t, x, jnp.asarray(0.01)), (-x.position[2], height)

        return jax.lax.scan(step, x, jnp.arange(6000.0))[1]

    height, elevation = (np.asarray(one)[1000:] for one in ridden(PLANT.initial_state()))
    assert np.std(elevation) > 0.05
    assert np.corrcoef(height, elevation)[0, 1] > 0.97
    assert np.std(height - elevation) < 0.3 * np.std(elevation)


@pytest.mark.full
def test_depths_that_are_stated():
    """The first counts, elevations add, and a disturbance under a surface stays what it is."""
    sea = waves(depth=3.0)
    assert stated_depths(SumOfDisturbances((sea, surface(2.0)))) == [3.0, 2.0]
    assert stated_depths(UnderSurface(SumOfDisturbances(()), surface(1.0))) == [1.0]
    assert stated_depths(SumOfDisturbances(())) == []
    key, pose = jax.random.PRNGKey(1), Pose(jnp.zeros(3), jnp.eye(3), jnp.zeros(3))
    both = SumOfDisturbances((surface(2.0), sea, sea))
    found = both.at(both.realize(key), ZERO, pose, PLANT.no_load()).surface
    alone = [sea.at(one, ZERO, pose, PLANT.no_load()).surface.elevation for one in both.realize(key)[1:]]
    assert float(found.depth) == 2.0 and float(found.elevation) == pytest.approx(float(sum(alone)))
    under = UnderSurface(sea, surface(3.0))
    np.testing.assert_array_equal(under.realize(key).phase, sea.realize(key).phase)
    with pytest.raises(BadInput, match="act on a body in water"):
        surface().at((), ZERO, None, PLANT.no_load())
