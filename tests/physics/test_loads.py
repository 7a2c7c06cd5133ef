"""Tether, payload and parameter error against what they must amount to."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import rotation_from_euler

from undertow.core.contracts import Pose
from undertow.core.errors import BadInput
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.disturbances.parameter_error import parameter_error
from undertow.physics.disturbances.payload import payload
from undertow.physics.disturbances.sheared_current import sheared_current
from undertow.physics.disturbances.tether import tether
from undertow.physics.disturbances.waves import waves
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin
from undertow.physics.vehicles.vehicle import VehicleModel

THRUSTER = paper_table3("static")
PLANT = hybrid_vehicle(odin(), THRUSTER)
POSE = jnp.array([1.0, -2.0, 3.0, 0.3, -0.5, 2.0])
RATES = jnp.array([0.4, -0.2, 0.1, 0.05, 0.1, -0.2])
VOLTS = jnp.linspace(-6.0, 8.0, 8)
ZERO = jnp.zeros(())


def body_rate(plant, load=None, t=0.0):
    """nu_dot at a state in motion; without the paper's convention on J_dot nu, which is about d."""
    return np.asarray(_body_rate(plant, load, jnp.asarray(t)))


@eqx.filter_jit
def _body_rate(plant, load, t):
    x = plant.initial_state(POSE, RATES)
    calm = plant.no_load()
    felt = calm if load is None else load.at(load.realize(jax.random.PRNGKey(7)), t, plant.pose(x), calm)
    return plant.dynamics(ZERO, x, VOLTS, felt).nu


def changed(**changes):
    """ODIN with other numbers."""
    fields = {field.name: getattr(odin(), field.name) for field in dataclasses.fields(VehicleModel)}
    return hybrid_vehicle(VehicleModel(**(fields | changes)), THRUSTER)


def test_payload_is_a_vehicle_with_that_point_mass_built_in():
    mass, weight, point = 3.0, 20.0, np.array([0.2, -0.1, 0.3])
    body = odin()
    gravity = float(body.weight / body.mass)
    heavy, lift = float(body.weight) + mass * gravity, mass * gravity - weight
    buoyant = float(body.buoyancy) + lift
    built = changed(
        mass=float(body.mass) + mass,
        weight=heavy,
        buoyancy=buoyant,
        r_g=(np.asarray(body.r_g) * float(body.weight) + point * mass * gravity) / heavy,
        r_b=(np.asarray(body.r_b) * float(body.buoyancy) + point * lift) / buoyant,
        inertia=np.asarray(body.inertia) + mass * (point @ point * np.eye(3) - np.outer(point, point)),
    )
    carried = payload(mass, weight, point, start=1.0, stop=2.0)
    np.testing.assert_allclose(body_rate(PLANT, carried, t=1.5), body_rate(built), rtol=0, atol=1e-12)
    for idle in (0.5, 2.5):
        np.testing.assert_allclose(body_rate(PLANT, carried, t=idle), body_rate(PLANT), rtol=0, atol=1e-12)
    assert carried.jumps(10.0) == (1.0, 2.0)


@pytest.mark.full
def test_two_payloads_are_one_after_the_other():
    halves = SumOfDisturbances((payload(1.0, 5.0, (0.1, 0, 0)), payload(1.0, 5.0, (0.1, 0, 0))))
    np.testing.assert_allclose(body_rate(PLANT, halves), body_rate(PLANT, payload(2.0, 10.0, (0.1, 0, 0))), atol=1e-12)


@pytest.fixture(scope="module")
def terms():
    """Of the equation of motion, by the name of the factor that scales each, N and N m."""

    def evaluate():
        x = PLANT.initial_state(POSE, RATES)
        return {
            "mass": -PLANT.body.coriolis(x.nu),
            "damping": -PLANT.body.damping(x.nu),
            "restoring": -PLANT.body.restoring(rotation_from_euler(POSE[3:])[2]),
            "thrust": PLANT.thruster_matrix @ THRUSTER.thrust(x.thrusters, VOLTS),
        }

    return {name: np.asarray(term) for name, term in jax.jit(evaluate)().items()}


@pytest.mark.parametrize("name", ["mass", "damping", "restoring", "thrust"])
def test_factor_scales_its_term_of_the_equation_of_motion(name, terms):
    factors = {"mass": 1.0, "damping": 1.0, "restoring": 1.0, "thrust": 1.0} | {name: 1.3}
    body = PLANT.body
    # Remark 2: on this fidelity J_dot nu belongs to what is prescribed, whatever the body is.
    prescribed = body_rate(PLANT) - np.linalg.solve(body.mass_matrix, sum(terms.values()))
    force = sum(factors[key] * term for key, term in terms.items())
    expected = np.linalg.solve(factors["mass"] * body.mass_matrix, force) + prescribed
    load = parameter_error(**{key: (value, value) for key, value in factors.items()})
    np.testing.assert_allclose(body_rate(PLANT, load), expected, rtol=0, atol=1e-12)


@pytest.mark.full
def test_factors_are_drawn_from_their_ranges():
    keys = jax.random.split(jax.random.PRNGKey(1), 2000)
    drawn = jax.jit(jax.vmap(parameter_error(mass=(0.9, 1.1), damping=(0.5, 2.0)).realize))(keys)
    for values, (low, high) in ((drawn.mass, (0.9, 1.1)), (drawn.damping, (0.5, 2.0))):
        assert low <= float(values.min()) and float(values.max()) <= high
        assert float(values.mean()) == pytest.approx((low + high) / 2, abs=0.03 * (high - low))
        assert float(values.std()) == pytest.approx((high - low) / np.sqrt(12), rel=0.05)


def pull(cable, position, angles=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)):
    place = Pose(jnp.asarray(position), rotation_from_euler(jnp.asarray(angles)), jnp.asarray(velocity))
    return -np.asarray(_wrench(cable, place))


@eqx.filter_jit
def _wrench(cable, place):
    return cable.at((), ZERO, place, PLANT.no_load()).wrench


def test_tether():
    cable = tether(anchor=(0.0, 0.0, -5.0), point=(0.1, 0.0, 0.0), length=10.0, stiffness=100.0, drag=4.0)
    np.testing.assert_allclose(pull(cable, [-0.1, 0, 4.0]), 0, atol=1e-12)  # slack
    np.testing.assert_allclose(pull(cable, [-0.1, 0, 6.0]), [0, 0, -100, 0, 10, 0], atol=1e-9)  # 1 m too far below
    turned = pull(cable, [0, -0.1, 6.0], angles=(0.0, 0.0, np.pi / 2))
    np.testing.assert_allclose(turned, [0, 0, -100, 0, 10, 0], atol=1e-9)
    slow = pull(cable, [-0.1, 0, 1.0], velocity=(0.5, 0.0, 0.0))
    np.testing.assert_allclose(slow, [-0.5 * 4.0 * 6.0 * 0.25, 0, 0, 0, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: tether(length=0.0), "`length` must be positive, but is 0 m"),
        (lambda: payload(mass=1.0, weight=20.0), "`weight` must be at most its weight in air"),
        (lambda: payload(start=2.0, stop=1.0), "`stop` must be later than start (2 s), but is 1 s"),
        (lambda: parameter_error(mass=(1.2, 0.8)), r"`mass` must be \(lowest, highest\), but is \[1.2, 0.8\]"),
        (lambda: parameter_error(mass=(0.0, 0.8)), r"`mass\[0\]` must be positive, but is 0"),
        (
            lambda: sheared_current(depths=(0.0,)),
            r"`depths` must be a list of two or more depths, but is of shape \(1,\)",
        ),
        (lambda: sheared_current(velocities=((1.0, 0.0),)), r"have 2 rows .* one per depth, but is of shape \(1, 2\)"),
        (lambda: sheared_current(depths=(5.0, 5.0)), r"`depths` must increase, but is \[5.0, 5.0\]"),
        (lambda: waves(components=0), "`components` must be 1 or more, but is 0"),
    ],
)
def test_bad_input(make, said):
    with pytest.raises(BadInput, match=said.replace("(2 s)", r"\(2 s\)")):
        make()


def test_jumps_of_several_disturbances_are_those_of_each():
    both = SumOfDisturbances((payload(start=1.0, stop=4.0), payload(start=4.0, stop=6.0), waves(), tether()))
    assert both.jumps(10.0) == (1.0, 4.0, 6.0) and both.jumps(5.0) == (1.0, 4.0) and both.jumps(4.0) == (1.0,)
    assert parameter_error().jumps(10.0) == ()
