"""I3, I4: three ways to write the hybrid system, Eqs. (1)-(20), give one acceleration; G and its rank."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import coriolis_matrix, jacobian

from undertow.core.contracts import Load
from undertow.core.numerics.rotations import Kinematics
from undertow.core.status import Status
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import paper_table3
from undertow.physics.thrusters.thruster import PropellerReport
from undertow.physics.vehicles import VehicleModel, odin

RNG = np.random.default_rng(2)
COUNT = 300
NOMINAL = hybrid_vehicle(odin(), paper_table3("electromechanical"))


def heavier(vehicle: VehicleModel) -> VehicleModel:
    """The true vehicle: everything differs from what the controller was told."""
    tilt = RNG.normal(size=(6, 6))
    return VehicleModel(
        name="true",
        mass=140.0,
        weight=1300.0,
        buoyancy=1250.0,
        r_g=[0.02, -0.01, 0.08],
        r_b=[0.0, 0.01, -0.02],
        inertia=np.diag([9.0, 7.0, 10.0]) + 0.2,
        added_mass=np.asarray(vehicle.added_mass) + 0.5 * tilt @ tilt.T,
        linear_damping=np.asarray(vehicle.linear_damping) + 5 * np.eye(6),
        quadratic_damping=1.3 * np.asarray(vehicle.quadratic_damping),
        thruster_positions=vehicle.thruster_positions,
        thruster_directions=vehicle.thruster_directions,
    )


PLANT = hybrid_vehicle(heavier(odin()), paper_table3("electromechanical"))
POSE = RNG.uniform(-1, 1, (COUNT, 6)) * np.array([10, 10, 10, np.pi, 1.3, np.pi])
VELOCITY, WRENCH = RNG.normal(size=(COUNT, 6)), 50 * RNG.normal(size=(COUNT, 6))
SPEED, CURRENT = 40 * RNG.normal(size=(COUNT, 8)), 5 * RNG.normal(size=(COUNT, 8))
VOLTS = 10 * RNG.normal(size=(COUNT, 8))


def situation(pose, velocity, speed, current, wrench):
    x = PLANT.initial_state(pose, velocity)
    x = x._replace(thrusters=x.thrusters._replace(speed=speed, current=current))
    return x, Load(jnp.zeros(6), wrench)


def accelerations(pose, velocity, speed, current, volts, wrench):
    """x_ddot of the plant, of (1.A), of Eqs. (4)-(5) and of Eq. (17) with d from its definition: phi known
    or not, J_dot nu known or not.
    """
    t = jnp.zeros(())
    x, load = situation(pose, velocity, speed, current, wrench)
    rates = PLANT.dynamics(t, x, volts, load)
    nu, nu_rate, y = x.nu, rates.nu, PLANT.output(t, x)
    nominal, true = NOMINAL.body, PLANT.body
    down = jacobian(pose[3:])[2, :3]

    def own(body):
        return body.coriolis(nu) + body.damping(nu) + body.restoring(down)

    delta = (true.mass_matrix - nominal.mass_matrix) @ nu_rate + own(true) - own(nominal)  # Eq. (3)

    j, j_rate = jax.jvp(jacobian, (pose[3:],), (velocity[3:],))
    inverse = jnp.linalg.inv(j)
    thrust = PLANT.thruster.thrust(x.thrusters, volts)
    tau = PLANT.thruster_matrix @ thrust
    direct = j_rate @ nu + j @ jnp.linalg.solve(nominal.mass_matrix, tau - own(nominal) - wrench - delta)

    coriolis = coriolis_matrix(nominal.mass_matrix, nu)
    damping = nominal.linear_damping + nominal.quadratic_damping * jnp.abs(nu)[None, :]
    m_j = inverse.T @ nominal.mass_matrix @ inverse
    inverse_rate = -inverse @ j_rate @ inverse
    moving = inverse.T @ (nominal.mass_matrix @ inverse_rate + (coriolis + damping) @ inverse) @ velocity
    f_k = -moving - inverse.T @ (nominal.restoring(down) + wrench + delta)
    lagrangian = jnp.linalg.solve(m_j, f_k + inverse.T @ tau)

    motor = PLANT.thruster.motor
    varphi = -motor.voltage_gain * (motor.k1 * rates.thrusters.speed + motor.k2 * speed)
    missing = -motor.voltage_gain * motor.inductance * rates.thrusters.current  # Delta_V of Eq. (15)

    def hybrid(unknown, speed_sensor=False, rate_term=False):
        model = NOMINAL.model(speed_sensor=speed_sensor, rate_term=rate_term)
        wrenches = PLANT.thruster_matrix @ unknown - wrench - delta
        lumped = j @ jnp.linalg.solve(nominal.mass_matrix, wrenches)
        known = model.dynamics.drift(y) + model.dynamics.gain(y) @ volts
        return known + lumped if rate_term else known + lumped + j_rate @ nu

    plant = PLANT.acceleration(t, x, volts, load)
    forms = hybrid(missing + varphi), hybrid(missing, speed_sensor=True), hybrid(missing + varphi, rate_term=True)
    return jnp.stack([plant, direct, lagrangian, *forms])


@pytest.mark.full
def test_all_forms_of_the_system_give_one_acceleration():
    found = np.asarray(jax.jit(jax.vmap(accelerations))(POSE, VELOCITY, SPEED, CURRENT, VOLTS, WRENCH))
    for i in range(1, 6):
        for k in range(i):
            difference = np.linalg.norm(found[:, i] - found[:, k], axis=1)
            assert (difference <= 1e-10 * np.linalg.norm(found[:, i], axis=1)).all()


def gains(pose):
    """G of the model, J M^-1 B alpha, and M_J^-1 J^-T B alpha."""
    y = NOMINAL.output(jnp.zeros(()), NOMINAL.initial_state(pose))
    j, inverse = jacobian(pose[3:]), jnp.linalg.inv(jacobian(pose[3:]))
    b_alpha = NOMINAL.thruster_matrix * NOMINAL.thruster.voltage_gain()
    m = NOMINAL.body.mass_matrix
    lagrangian = jnp.linalg.solve(inverse.T @ m @ inverse, inverse.T @ b_alpha)
    return NOMINAL.model().dynamics.gain(y), j @ jnp.linalg.solve(m, b_alpha), lagrangian


STEEP = POSE * np.array([1, 1, 1, 1, 1.5 / 1.3, 1])
CODE, DIRECT, LAGRANGIAN = (np.asarray(g) for g in jax.jit(jax.vmap(gains))(STEEP))


def test_gain_matrix_is_what_the_paper_says_it_is():
    scale = np.linalg.norm(DIRECT, axis=(1, 2))
    assert (np.linalg.norm(CODE - DIRECT, axis=(1, 2)) <= 1e-10 * scale).all()
    assert (np.linalg.norm(CODE - LAGRANGIAN, axis=(1, 2)) <= 1e-10 * scale).all()


@pytest.mark.parametrize(
    ("numbers", "rank"),
    [
        ((1, 2, 3, 4), 3),
        *(
            pytest.param(numbers, rank, marks=pytest.mark.full)
            for numbers, rank in (
                (range(1, 9), 6),
                ((5, 6, 7, 8), 3),
                ((1, 2, 3, 5, 6), 5),
                ((1,), 1),
                (range(2, 9), 6),
            )
        ),
    ],
)
def test_rank_of_gain_is_the_rank_of_the_thruster_matrix(numbers, rank):
    """Wherever |pitch| < 1.5: geometry decides once and for all."""
    plant = hybrid_vehicle(odin().with_thrusters(tuple(numbers)), paper_table3("ideal"))
    columns = np.array(numbers) - 1
    np.testing.assert_allclose(
        plant.model().dynamics.body_gain, np.asarray(NOMINAL.model().dynamics.body_gain)[:, columns], rtol=1e-14
    )
    singular = np.linalg.svd(CODE[:, :, columns], compute_uv=False)
    assert ((singular > 1e-10 * singular[:, :1]).sum(1) == rank).all()
    assert plant.rank() == rank


def test_status_of_a_vehicle():
    """Euler angles exist but near pitch 90 degrees; nothing is farther than 1 km or faster than 1 km/s."""
    start = NOMINAL.initial_state(jnp.asarray([1.0, 2.0, 3.0, 0.4, 0.0, 0.5]))
    turned = lambda pitch: NOMINAL.initial_state(jnp.asarray([1.0, 2.0, 3.0, 0.0, pitch, 0.0]))
    fast = start.nu.at[2].set(-1.1e3)
    cases = {
        "OK": [start, turned(np.pi / 2 - 2e-3), start._replace(nu=start.nu.at[2].set(-9e2))],
        "PITCH_SINGULAR": [turned(np.pi / 2 - 5e-4), turned(-np.pi / 2 + 5e-4)],
        "DIVERGED": [
            start._replace(nu=fast),
            start._replace(position=start.position * 1e3),
            turned(np.pi / 2)._replace(nu=fast),
        ],
    }
    status = jax.jit(lambda x: NOMINAL.status(x))
    for name, states in cases.items():
        assert [int(status(x)) for x in states] == [int(Status[name])] * len(states), name


def test_a_known_speed_of_the_propellers_adds_its_term_to_the_model():
    """phi of Eq. (15) for each thruster, as thrust; the rate of the speed is in it."""
    without, known = (NOMINAL.model(speed_sensor=on).dynamics for on in (False, True))
    speed, rate = jnp.linspace(-30.0, 40.0, 8), jnp.linspace(5.0, -6.0, 8)
    x = NOMINAL.initial_state(*map(jnp.asarray, (POSE[0], VELOCITY[0])))
    motor = NOMINAL.thruster.motor

    @jax.jit
    def difference(x):
        y = NOMINAL.output(0.0, x)._replace(actuator=PropellerReport(speed, rate))
        kinematics = Kinematics(y.body.rotation)
        phi = -motor.voltage_gain * (motor.k1 * rate + motor.k2 * speed)
        return known.drift(y) - without.drift(y), kinematics.to_world(
            NOMINAL.body.accelerate(NOMINAL.thruster_matrix @ phi)
        )

    found, expected = difference(x)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_what_laws_compensate_is_the_drift_at_the_velocity_of_the_target():
    """M^-1 (-C nu - D nu - g), nu that of the target, the attitude that of the vehicle; in Euler angles as in body axes."""
    outputs, body = NOMINAL.model(), NOMINAL.body
    pose, nu, off = (jnp.asarray(one[0]) for one in (POSE, VELOCITY, WRENCH / 50))

    @jax.jit
    def compensated(pose, nu, off):
        kinematics = Kinematics(jacobian(pose[3:])[:3, :3])
        y = outputs.coordinates.measurement(pose, kinematics.to_world(nu))
        target, down = nu + off, jacobian(pose[3:])[2, :3]
        expected = jnp.linalg.solve(
            body.mass_matrix, -body.coriolis(target) - body.damping(target) - body.restoring(down)
        )
        found = outputs.in_body_axes().drift_at_target_velocity(y, off)
        in_outputs = outputs.drift_at_target_velocity(y, kinematics.to_world(off))
        return found, kinematics.to_body(in_outputs), expected

    found, in_outputs, expected = compensated(pose, nu, off)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    np.testing.assert_allclose(in_outputs, expected, rtol=1e-9)


@pytest.mark.full
def test_inverse_of_the_model_is_the_pseudo_inverse_of_its_gain():
    """Also below rank 6, where the closed form does not hold."""
    for numbers in (tuple(range(1, 9)), (1, 2, 3, 4)):
        plant = hybrid_vehicle(odin().with_thrusters(numbers), paper_table3("ideal"))
        model = plant.model()

        def both(pose, wanted, plant=plant, model=model):
            y = plant.output(jnp.zeros(()), plant.initial_state(pose))
            return model.dynamics.invert(y, wanted), jnp.linalg.pinv(model.dynamics.gain(y), rtol=1e-10) @ wanted

        found, expected = map(np.asarray, jax.jit(jax.vmap(both))(POSE, VELOCITY))
        difference = np.linalg.norm(found - expected, axis=1)
        assert (difference <= 1e-9 * np.linalg.norm(expected, axis=1)).all()
