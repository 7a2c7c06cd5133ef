"""The same vehicle in MuJoCo's engine: axes, mass, thruster geometry, and accelerations at random states."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from mujoco_states import poses, undertow_acceleration
from textbook import rotation_from_euler

from undertow.core.errors import BadInput
from undertow.core.numerics.rotations import Kinematics
from undertow.outside.mujoco_engine import Submerged, UniformFlow, mjcf
from undertow.outside.mujoco_engine.mjcf import as_rigid_body
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import paper_table3
from undertow.physics.vehicles import bluerov2, bluerov2_heavy, lauv, npsauv2, odin, remus100, rexrov
from undertow.physics.vehicles.body import rigid_body_mass

pytestmark = pytest.mark.full

VEHICLES = [odin, bluerov2, bluerov2_heavy, rexrov, npsauv2, remus100, lauv]
FLIP = np.diag([1.0, -1, -1])


@pytest.fixture(scope="module", params=VEHICLES, ids=lambda make: make.__name__)
def vehicle(request):
    return request.param()


@pytest.fixture(scope="module")
def acceleration(vehicle):
    return undertow_acceleration(vehicle)


def test_axes_turn_half_a_turn_about_x():
    """Nose up 30 degrees, 2 m east, 3 m down; moving forward and turning to starboard."""
    body = Submerged(odin())
    body.place([1, 2, 3, 0, np.pi / 6, 0], [1, 0, 0, 0, 0, 0.5])
    np.testing.assert_allclose(body.data.qpos[:3], [1, -2, -3], atol=1e-15)
    np.testing.assert_allclose(body.data.qvel[:3], [np.sqrt(0.75), 0, 0.5], atol=1e-15)  # MuJoCo's z is up
    np.testing.assert_allclose(body.data.qvel[3:], [0, 0, -0.5], atol=1e-15)  # clockwise from above


def test_states_come_back():
    body = Submerged(rexrov())
    etas, nus, _ = poses(20, seed=1)
    for eta, nu in zip(etas, nus, strict=True):
        body.place(eta, nu)
        np.testing.assert_allclose(body.position(), eta, atol=1e-14)
        np.testing.assert_allclose(body.nu(), nu, atol=1e-14)
        rotation = rotation_from_euler(jnp.asarray(eta[3:]))
        np.testing.assert_allclose(body.rotation(), rotation, atol=1e-15)
        np.testing.assert_allclose(body.velocity(), Kinematics(rotation).to_world(jnp.asarray(nu)), atol=1e-13)


def test_the_engine_has_the_rigid_body(vehicle):
    """Its mass matrix upright is M_RB; its weight and buoyancy are those of the vehicle."""
    body = Submerged(vehicle)
    body.place(np.zeros(6), np.zeros(6))
    mujoco.mj_forward(body.model, body.data)
    matrix = np.empty((6, 6))
    mujoco.mj_fullM(body.model, body.data, matrix)
    turn = np.kron(np.eye(2), FLIP)
    expected = np.asarray(rigid_body_mass(vehicle.mass, vehicle.r_g, vehicle.inertia))
    np.testing.assert_allclose(turn @ matrix @ turn, expected, atol=1e-12 * expected.max())
    engine = turn @ (body.data.qfrc_passive - body.data.qfrc_bias)
    restoring = -np.asarray(vehicle.body().restoring(jnp.array([0.0, 0.0, 1.0])))
    np.testing.assert_allclose(engine, restoring, atol=1e-12 * float(vehicle.weight))


def test_thrusters_push_where_they_are(vehicle):
    body = Submerged(vehicle)
    body.place(np.zeros(6), np.zeros(6))
    turn = np.kron(np.eye(2), FLIP)
    for column in range(vehicle.thrusters):
        body.data.ctrl[:] = np.eye(vehicle.thrusters)[column]
        mujoco.mj_forward(body.model, body.data)
        expected = np.asarray(vehicle.thruster_matrix())[:, column]
        np.testing.assert_allclose(turn @ body.data.qfrc_actuator, expected, atol=1e-14)


@pytest.mark.parametrize("moving", [False, True], ids=["still water", "water that moves and accelerates"])
def test_accelerations_agree(vehicle, acceleration, moving):
    """Fifty states, up to 40 N per thruster. Measured: 1e-13 of the largest entry."""
    etas, nus, chance = poses(50, seed=2)
    for eta, nu in zip(etas, nus, strict=True):
        thrust = chance.uniform(-40, 40, vehicle.thrusters)
        velocity, rising = chance.uniform(-1, 1, (2, 3)) * moving
        body = Submerged(vehicle, water=UniformFlow(velocity, rising))
        body.place(eta, nu)
        expected = np.asarray(acceleration(eta, nu, thrust, velocity, rising))
        np.testing.assert_allclose(body.acceleration(thrust), expected, atol=1e-12 * np.abs(expected).max())


def test_added_mass_of_a_sphere_can_be_a_body():
    """ODIN's is; as a weightless body inside the engine it does what it does as a force, moving water included."""
    etas, nus, chance = poses(20, seed=3)
    for eta, nu in zip(etas, nus, strict=True):
        thrust, water = chance.uniform(-40, 40, 8), UniformFlow(*chance.uniform(-1, 1, (2, 3)))
        inside, applied = (Submerged(odin(), added_mass=how, water=water) for how in ("body", "force"))
        inside.place(eta, nu)
        applied.place(eta, nu)
        np.testing.assert_allclose(inside.acceleration(thrust), applied.acceleration(thrust), atol=1e-13)


def test_what_added_mass_can_be_a_body():
    body = as_rigid_body(rigid_body_mass(jnp.asarray(3.0), jnp.array([0.1, -0.2, 0.3]), 2 * jnp.eye(3)))
    assert body is not None
    np.testing.assert_allclose([body.mass, *body.centre], [3, 0.1, -0.2, 0.3], rtol=1e-14)
    assert as_rigid_body(np.diag([1.0, 2, 2, 0, 0, 0])) is None  # heavier sideways
    assert as_rigid_body(np.diag([1.0, 1, 1, 1, 1, 3])) is None  # no mass is spread like that
    assert as_rigid_body(np.zeros((6, 6))) is None
    for make in VEHICLES[1:]:
        with pytest.raises(BadInput, match="`added_mass` must be one that a rigid body could have"):
            mjcf(make(), added_mass=True)


@pytest.mark.parametrize("density", [0, 1000])
def test_the_engines_own_water_has_no_inertia(density):
    """Why it is not used: 100 N move 41.9 kg from rest at 100 / 41.9 m/s^2, in water as in vacuum."""
    ellipsoid = '<geom type="ellipsoid" size="0.5 0.2 0.1" mass="41.9" fluidshape="ellipsoid"/>'
    world = f"<worldbody><body><freejoint/>{ellipsoid}</body></worldbody>"
    model = mujoco.MjModel.from_xml_string(f'<mujoco><option gravity="0 0 0" density="{density}"/>{world}</mujoco>')
    data = mujoco.MjData(model)
    data.qfrc_applied[2] = 100
    mujoco.mj_forward(model, data)
    assert data.qacc[2] == pytest.approx(100 / 41.9, rel=1e-12)


def test_on_the_static_rung_undertow_is_not_newton():
    """There the paper prescribes the whole of d (Remark 2), J_dot nu with it: the body lacks exactly this term."""
    vehicle, body = rexrov(), Submerged(rexrov())
    plant = hybrid_vehicle(vehicle, paper_table3("static"))

    @jax.jit
    def expected(eta, nu):
        kinematics = Kinematics(rotation_from_euler(eta[3:]))
        missing = kinematics.to_body(kinematics.rate_term(nu))
        x = plant.initial_state(eta)._replace(nu=nu)
        return plant.dynamics(jnp.zeros(()), x, jnp.zeros(8), plant.no_load()).nu + missing

    etas, nus, _ = poses(10, seed=4)
    for eta, nu in zip(etas, nus, strict=True):
        body.place(eta, nu)
        np.testing.assert_allclose(body.acceleration(np.zeros(8)), expected(eta, nu), atol=1e-12)


def test_any_name_will_do():
    vehicle = replace(odin(), name='"A" & <B>')
    assert Submerged(vehicle).model.names.startswith(b'"A" & <B>')


def test_impossible_inertia_is_refused():
    wrong = eqx.tree_at(lambda v: v.inertia, odin(), jnp.diag(jnp.array([1.0, 1.0, 8.0])))
    with pytest.raises(BadInput, match="`inertia` must be that of a rigid body"):
        mjcf(wrong)
